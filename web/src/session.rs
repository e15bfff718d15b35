//! One run: commands in, events out.
use crate::{
    events::Page,
    failure::Failure,
    message::*,
    open::{check_settings, parse, text},
    run::OpenRun,
    saved::saved_run,
};
use js_sys::{Function, Uint8Array};
use wasm_bindgen::prelude::*;

/// See the crate. Commands are followed one at a time: the host waits for one before it gives the
/// next.
#[wasm_bindgen]
pub struct Session {
    page: Page,
    run: Option<OpenRun>,
}

#[wasm_bindgen]
impl Session {
    /// A session without a recording; `emit` is called with its events.
    #[wasm_bindgen(constructor)]
    pub fn new(
        #[wasm_bindgen(unchecked_param_type = "(event: Event) => void")] emit: Function,
    ) -> Session {
        Session { page: Page::new(emit), run: None }
    }

    /// Follows a command. Failures are emitted as `error`; the result says whether there was none.
    pub async fn handle(
        &mut self,
        #[wasm_bindgen(unchecked_param_type = "Command")] command: JsValue,
    ) -> bool {
        let done = self.follow(&command).await;
        done.map_err(|f| self.page.emit(&Event::Error(f.0))).is_ok()
    }

    /// Processes one frame; after the last one the map is refined. Returns whether there is more.
    pub async fn step(&mut self) -> bool {
        let step = match self.open_run() {
            Ok(run) => run.step_and_save().await,
            Err(f) => Err(f),
        };
        step.unwrap_or_else(|f| {
            self.page.emit(&Event::Error(f.0));
            false
        })
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
                        let saved = saved_run(&bytes.to_vec())?;
                        OpenRun::resume(&self.page, &source, settings, saved).await?
                    }
                    Err(_) => OpenRun::open(&self.page, &source, settings).await?,
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

    fn open_run(&mut self) -> Result<&mut OpenRun, Failure> {
        self.run.as_mut().ok_or_else(|| Failure::new(ErrorKind::Command, "nothing is open"))
    }
}
