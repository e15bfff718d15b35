//! The layout of TUM RGB-D.
use super::{ColorFormat, Files, RecordingWriter, WriteError};
use mte_slam_types::frame::{Frame, SequenceInfo};

/// TUM's units of depth per metre, which other programs take for granted.
const UNITS: f64 = 5000.0;

/// Writes frames as `rgb/STAMP.png|jpg` and `depth/STAMP.png` (1/5000 m, so that other units are
/// rounded to it), and at the end `rgb.txt`, `depth.txt`, `groundtruth.txt` and `camera.txt`; with
/// labels also `semantic_class/` and `classes.json`.
pub struct TumWriter<F> {
    files: Files<F>,
    lists: [String; 3],
    written: usize,
    /// The last stamp, which the next one must exceed.
    last_us: i64,
    /// Pixels deeper than TUM's 13.1 m.
    too_deep: u64,
}

impl<F: FnMut(&str, &[u8]) -> std::io::Result<()>> TumWriter<F> {
    /// Returns a writer of frames of the given sequence.
    pub fn new(info: &SequenceInfo, color: ColorFormat, sink: F) -> Self {
        let lists = [
            "# colour images: stamp file\n".into(),
            "# depth images: stamp file\n".into(),
            "# ground truth: stamp tx ty tz qx qy qz qw\n".into(),
        ];
        let files = Files::new(info, color, sink);
        Self { files, lists, written: 0, last_us: i64::MIN, too_deep: 0 }
    }

    /// How many pixels so far were deeper than the layout can say; they were written as holes.
    pub fn too_deep(&self) -> u64 {
        self.too_deep
    }

    /// Returns depth in TUM's unit.
    fn depth(&mut self, depth: &[u16]) -> Vec<u16> {
        let ratio = self.files.info.depth_unit_m * UNITS;
        let mut out = Vec::with_capacity(depth.len());
        for &d in depth {
            let value = (f64::from(d) * ratio).round();
            let fits = value <= 65535.0;
            self.too_deep += u64::from(!fits);
            out.push(if fits { value as u16 } else { 0 });
        }
        out
    }
}

impl<F: FnMut(&str, &[u8]) -> std::io::Result<()>> RecordingWriter for TumWriter<F> {
    fn write(&mut self, frame: &Frame) -> Result<(), WriteError> {
        self.files.check(frame)?;
        // Files are called by their stamps, so each needs its own.
        let us = (frame.time_s * 1e6).round();
        let us = if us.is_finite() { us as i64 } else { frame.index as i64 * 1_000_000 };
        let us = us.max(self.last_us.saturating_add(1)).max(0);
        self.last_us = us;
        let stamp = format!("{}.{:06}", us / 1_000_000, us % 1_000_000);
        let color_file = format!("rgb/{stamp}.{}", self.files.color.ending());
        let bytes = self.files.color(&color_file, &frame.color)?;
        self.files.put(&color_file, &bytes)?;
        let depth_file = format!("depth/{stamp}.png");
        let depth = self.depth(&frame.depth);
        self.files.put_depth(&depth_file, &depth)?;
        self.files.put_labels(self.written, frame)?;
        let [rgb, depth, truth] = &mut self.lists;
        *rgb += &format!("{stamp} {color_file}\n");
        *depth += &format!("{stamp} {depth_file}\n");
        if let Some(pose) = frame.truth {
            let (t, q) = (pose.translation, pose.quaternion());
            let numbers = [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(|x| format!("{x:e}"));
            *truth += &format!("{stamp} {}\n", numbers.join(" "));
        }
        self.written += 1;
        Ok(())
    }

    fn finish(mut self) -> Result<usize, WriteError> {
        for (file, text) in ["rgb.txt", "depth.txt", "groundtruth.txt"].into_iter().zip(&self.lists)
        {
            self.files.put(file, text.as_bytes())?;
        }
        let c = self.files.info.camera;
        let text = format!("# fx fy cx cy\n{} {} {} {}\n", c.fx, c.fy, c.cx, c.cy);
        self.files.put("camera.txt", text.as_bytes())?;
        self.files.put_lists()?;
        Ok(self.written)
    }
}
