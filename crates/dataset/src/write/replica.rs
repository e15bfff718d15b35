//! The layout of Replica's NICE-SLAM render.
use super::{ColorFormat, Files, RecordingWriter, WriteError};
use mte_slam_types::frame::{Frame, SequenceInfo};
use serde_json::json;

/// Writes frames as `results/frame%06d.jpg|png`, `results/depth%06d.png` and
/// `semantic_class/semantic_class_%06d.png`, and at the end `traj.txt`, `cam_params.json`,
/// `classes.json` and `bound.json`; [`crate::open`] reads them back.
pub struct ReplicaWriter<F> {
    files: Files<F>,
    trajectory: String,
    written: usize,
}

impl<F: FnMut(&str, &[u8]) -> std::io::Result<()>> ReplicaWriter<F> {
    /// Returns a writer of frames of the given sequence.
    pub fn new(info: &SequenceInfo, color: ColorFormat, sink: F) -> Self {
        Self { files: Files::new(info, color, sink), trajectory: String::new(), written: 0 }
    }
}

impl<F: FnMut(&str, &[u8]) -> std::io::Result<()>> RecordingWriter for ReplicaWriter<F> {
    fn write(&mut self, frame: &Frame) -> Result<(), WriteError> {
        let number = self.written;
        self.files.check(frame)?;
        let file = format!("results/frame{number:06}.{}", self.files.color.ending());
        let bytes = self.files.color(&file, &frame.color)?;
        self.files.put(&file, &bytes)?;
        self.files.put_depth(&format!("results/depth{number:06}.png"), &frame.depth)?;
        self.files.put_labels(number, frame)?;
        // Without a pose the line says so the way ScanNet does.
        let row = frame.truth.map_or([f64::NEG_INFINITY; 16], |pose| pose.to_row_major());
        let words: Vec<String> = row.iter().map(|x| format!("{x:e}")).collect();
        self.trajectory += &words.join(" ");
        self.trajectory.push('\n');
        self.written += 1;
        Ok(())
    }

    fn finish(mut self) -> Result<usize, WriteError> {
        self.files.put("traj.txt", self.trajectory.as_bytes())?;
        let (c, unit) = (self.files.info.camera, self.files.info.depth_unit_m);
        self.files.put_json(
            "cam_params.json",
            &json!({"camera": {
                "w": c.width, "h": c.height, "fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy,
                "scale": 1.0 / unit,
            }}),
        )?;
        self.files.put_lists()?;
        Ok(self.written)
    }
}
