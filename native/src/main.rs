//! The command line of MTE-SLAM. Exit codes: 0 done, 1 something failed while working, 2 the
//! command line or configuration is wrong.
#![forbid(unsafe_code)]

mod args;
mod command_line;
mod commands;
mod configuration;
mod engine;
mod errors;
mod host;
mod input;
mod invocation;
mod memory;
mod novel;
mod output;
mod pipeline;
mod progress;
mod record;
mod restore;
mod results;
mod resume;
mod screen;
mod segmentation;
mod server;
mod source;
mod steps;
mod suite;
mod synthetic;
mod views;

use args::{Cli, Command};
use mte_slam_report::{class_truth, evaluation, mesh_evaluation};
use std::process::ExitCode;

fn main() -> ExitCode {
    suite::process::end_with_parent();
    match command_line::command_line().and_then(|cli| follow(&cli)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            let usage = error.downcast_ref::<errors::UsageError>().is_some();
            ExitCode::from(if usage { 2 } else { 1 })
        }
    }
}

fn follow(cli: &Cli) -> anyhow::Result<()> {
    let screen = screen::Screen { quiet: cli.quiet, json: cli.json };
    match &cli.command {
        Command::Demo(args) => commands::demo::run(args, screen),
        Command::Run(args) => commands::run::run(args, screen),
        Command::Eval(args) => commands::eval::run(args, screen),
        Command::Mesh(args) => commands::mesh::run(args, screen),
        Command::Objects(args) => commands::objects::run(args, screen),
        Command::Render(args) => commands::render::run(args, screen),
        Command::Synth(args) => commands::synth::run(args, screen),
        Command::Inspect(args) => commands::inspect::run(args, screen),
        Command::Convert(args) => commands::convert::run(args, screen),
        Command::Label(args) => commands::label::run(args, screen),
        Command::Serve(args) => commands::serve::run(args, screen),
        Command::Evaluate(args) => commands::evaluate::run(args, screen),
        Command::Info(args) => commands::info::run(args, screen),
        Command::Ablate(args) => commands::ablate::run(args, screen),
        Command::Bench(args) => commands::bench::run(args, screen),
        Command::Shaders(args) => commands::shaders::run(args, screen),
        Command::Settings(args) => commands::settings::run(args, screen),
    }
}
