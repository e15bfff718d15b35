//! What the odometry corrects later: where colour lies on depth, and poses of frames that its
//! keyframes move.
use super::{Slam, SlamError};
use crate::{
    commands::Commands, config::Tracker, frame::Frame, track::odometry::ColorRegistration,
};
use alloc::{borrow::Cow, vec::Vec};

impl Slam {
    /// Where the map takes the colour image to lie on the depth image: what the odometry has found,
    /// the identity as long as nothing speaks against it (and with true poses, where no odometry
    /// runs).
    pub fn color_registration(&self) -> ColorRegistration {
        self.registration
    }

    /// The frame as the map is trained with it: colour and labels in the depth camera's pixels.
    /// Compare rendered views with this.
    pub fn registered<'a>(&self, frame: &'a Frame) -> Cow<'a, Frame> {
        self.registration.registered(frame, &self.info.camera)
    }

    /// Takes over a registration of colour that the odometry found or improved. It settles only
    /// after some keyframes; the images of those before are stored already, so they are read back,
    /// resampled and stored again. What the map has learned from them already fades as later
    /// iterations draw from the corrected images.
    pub(super) async fn follow_registration(&mut self, frame: usize) -> Result<(), SlamError> {
        let found = self.odometer.color_registration();
        if found == self.registration {
            return Ok(());
        }
        self.registrations.push((frame, found));
        // The stored images have the former registration applied.
        let change = ColorRegistration { scale: found.scale / self.registration.scale };
        self.registration = found;
        let camera = self.info.camera;
        let slots: Vec<u32> = self.keyframes.iter().map(|k| k.slot).collect();
        for slot in slots {
            let (engine, map, _) = self.mapped()?;
            let image = map.frames.read_color(engine, slot).await?;
            let mut r = Commands::default();
            map.frames.upload_color(&mut r, slot, &change.resampled(&image, &camera));
            engine.submit(&r)?;
        }
        Ok(())
    }

    /// Takes over the poses of all frames from the odometer, which moves them with its keyframes.
    pub(super) fn follow_odometer(&mut self) {
        if self.config.tracking.tracker == Tracker::Truth {
            return;
        }
        for (entry, (_, pose, _)) in self.frames.iter_mut().zip(self.odometer.trajectory()) {
            entry.world_from_camera = pose;
        }
        for k in &mut self.keyframes {
            if let Some(f) = self.frames.get(k.frame) {
                k.world_from_camera = f.world_from_camera;
            }
        }
    }
}
