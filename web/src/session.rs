//! One run: commands in, events out.
use crate::{
    events::{self, emit},
    failure::Failure,
    message::*,
    open::{check_settings, parse, text},
    run::Run,
    saved::SavedRun,
};
use js_sys::{Function, Uint8Array};
use wasm_bindgen::prelude::*;

/// See the crate. Commands are followed one at a time: the host waits for one before it gives the
/// next.
#[wasm_bindgen]
pub struct Session {
    run: Option<Run>,
}

#[wasm_bindgen]
impl Session {
    /// A session without a recording; `emit` hears its events.
    #[wasm_bindgen(constructor)]
    pub fn new(
        #[wasm_bindgen(unchecked_param_type = "(event: Event) => void")] emit: Function,
    ) -> Session {
        events::listen(emit);
        Session { run: None }
    }

    /// Follows a command. Failures are emitted as `error`; the result says whether there was none.
    pub async fn handle(
        &mut self,
        #[wasm_bindgen(unchecked_param_type = "Command")] command: JsValue,
    ) -> bool {
        let done = self.follow(&command).await;
        done.map_err(|f| emit(&Event::Error(f.0))).is_ok()
    }

    /// Processes one frame; after the last one the map is refined. Says whether there is more.
    pub async fn step(&mut self) -> bool {
        let Some(run) = self.run.as_mut() else {
            emit(&Event::Error(Failure::new(ErrorKind::Command, "nothing is open").0));
            return false;
        };
        match run.step_and_save().await {
            Ok(more) => more,
            Err(f) => {
                emit(&Event::Error(f.0));
                false
            }
        }
    }

    async fn follow(&mut self, command: &JsValue) -> Result<(), Failure> {
        match text(command, "type").as_deref() {
            Some("open") => {
                // Two maps at once could pass the device's memory.
                self.run = None;
                check_settings(command)?;
                let OpenCommand { source, settings, keep, resume } = parse(command, "open")?;
                let run = match resume.dyn_into::<Uint8Array>() {
                    Ok(bytes) => {
                        let saved = SavedRun::from_bytes(&bytes.to_vec())?;
                        Run::resume(&source, settings, saved).await?
                    }
                    Err(_) => Run::open(&source, settings).await?,
                };
                self.run.insert(run).keep = keep;
                Ok(())
            }
            Some("seekView") => {
                let view = parse(command, "seekView")?;
                self.open_run()?.seek(&view).await
            }
            Some("export") => {
                let export = parse(command, "export")?;
                self.open_run()?.export(&export).await
            }
            Some("step") => {
                self.open_run()?.step().await?;
                Ok(())
            }
            Some("save") => self.open_run()?.save().await,
            Some("refresh") => self.open_run()?.refresh().await,
            Some("dispose") => {
                self.run = None;
                Ok(())
            }
            // The host's part: it calls `step`, or does not.
            Some("start" | "pause") => self.open_run().map(drop),
            other => Err(Failure::new(
                ErrorKind::Command,
                format!(
                    "command: type: found {other:?}, expected open, start, pause, step, seekView, export, save, refresh or dispose"
                ),
            )),
        }
    }

    fn open_run(&mut self) -> Result<&mut Run, Failure> {
        self.run.as_mut().ok_or_else(|| Failure::new(ErrorKind::Command, "nothing is open"))
    }
}
