//! The command line that this process follows: its own, or the one that a folder or a file keeps.
use crate::{
    args::{Cli, Command},
    errors::usage,
    invocation::Invocation,
    resume::{COMMAND, FOLDER},
    suite::run_file,
};
use anyhow::{Context, Result, bail};
use clap::Parser;
use std::fs;

/// The command line of this process, or the one that `--resume DIR` stands for.
pub fn command_line() -> Result<Cli> {
    let invocation = Invocation::here();
    let mut cli = from_file(Cli::parse(), &invocation)?;
    let Some(output) = cli.command.output_mut() else { return Ok(cli) };
    let dir = output.resume.take_if(|r| r.is_some()).flatten();
    let Some(dir) = dir else {
        output.invocation = invocation;
        return Ok(cli);
    };
    if invocation.only_resumes().is_none() {
        // With the whole command line, DIR is its output folder.
        if output.out.as_ref().is_some_and(|out| *out != dir) {
            usage!("--resume {}: found --out with another folder, expected one", dir.display());
        }
        output.out = Some(dir);
        output.resume = Some(None);
        output.invocation = invocation;
        return Ok(cli);
    }
    let path = dir.join(FOLDER).join(COMMAND);
    if !path.is_file() {
        usage!(
            "--resume {0}: found no interrupted run ({1}), expected the output folder of one. If \
             it has finished, there is nothing to do.",
            dir.display(),
            path.display()
        );
    }
    let name = path.display().to_string();
    let text = fs::read_to_string(&path).with_context(|| format!("{name}: cannot be read"))?;
    let kept: Invocation =
        serde_json::from_str(&text).with_context(|| format!("{name}: not a command line"))?;
    let advice = "repeat the whole command with --resume at its end";
    if kept.arguments.is_empty() {
        bail!("{name}: the command line is not Unicode and was not kept: {advice}");
    }
    let program = std::iter::once("mte-slam".to_owned());
    let mut first = Cli::try_parse_from(program.chain(kept.arguments.iter().cloned()))
        .map_err(|e| anyhow::anyhow!("{name}: {e}{advice}"))?;
    let out = dir.canonicalize().with_context(|| format!("{}: no such folder", dir.display()))?;
    std::env::set_current_dir(&kept.folder).with_context(|| {
        format!("{}: the run was started there: {advice}", kept.folder.display())
    })?;
    first = from_file(first, &kept)?;
    let Some(output) = first.command.output_mut() else {
        bail!("{name}: found a command that makes no run");
    };
    (output.out, output.resume, output.invocation) = (Some(out), Some(None), kept);
    (first.quiet, first.json) = (cli.quiet, cli.json);
    Ok(first)
}

/// With `run --from FILE`: what the file stands for.
fn from_file(mut cli: Cli, invocation: &Invocation) -> Result<Cli> {
    let Command::Run(args) = &mut cli.command else { return Ok(cli) };
    let Some(file) = args.from.take() else { return Ok(cli) };
    // An argument that is not Unicode leaves none to compare.
    if !invocation.arguments.is_empty() && invocation.only("--from").is_none() {
        usage!(
            "--from {}: found other arguments beside it, expected none: the file has them all",
            file.display()
        );
    }
    *args = run_file::run_args(&file)?;
    Ok(cli)
}
