//! `wasm-bindgen MODULE.wasm --out-dir FOLDER [--target web] [--typescript | --no-typescript]
//! [--out-name NAME]` and `wasm-bindgen --version`, for modules that pages load: the part of
//! wasm-bindgen's own command that scripts/build-web.sh, scripts/test-web.sh and wasm-pack use.
use anyhow::{Context, Result, bail};
use std::path::PathBuf;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let mut bindgen = Bindgen::new();
    // As the command does: the initialization finds the module beside its script by itself.
    bindgen.web(true)?.typescript(true).omit_default_module_path(false);
    let (mut module, mut folder) = (None, None);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().with_context(|| format!("{argument}: no value"));
        match argument.as_str() {
            "--version" | "-V" => {
                println!("wasm-bindgen {}", wasm_bindgen_shared::version());
                return Ok(());
            }
            "--target" => {
                let target = value()?;
                if target != "web" {
                    bail!("--target: found '{target}', expected 'web'");
                }
            }
            "--out-dir" => folder = Some(PathBuf::from(value()?)),
            "--out-name" => {
                let name = value()?;
                bindgen.out_name(&name);
            }
            "--typescript" => {
                bindgen.typescript(true);
            }
            "--no-typescript" => {
                bindgen.typescript(false);
            }
            // Names of functions are kept, as a profile for development wants them.
            "--debug" => {
                bindgen.debug(true);
            }
            unknown if unknown.starts_with('-') => {
                bail!("found {unknown}, which is not known here")
            }
            path if module.is_none() => module = Some(PathBuf::from(path)),
            second => bail!("found a second module, {second}"),
        }
    }
    let module = module.context("expected the path of a WebAssembly module")?;
    let folder = folder.context("expected --out-dir FOLDER")?;
    bindgen.input_path(&module);
    bindgen.generate(&folder).with_context(|| module.display().to_string())
}
