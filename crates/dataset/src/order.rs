//! In which order the frames of a list are taken.

/// The order of frames that are listed in a file (TUM RGB-D and nerfstudio).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameOrder {
    /// By time stamps, or by the numbers in the names of the images.
    #[default]
    Time,
    /// As the lines of the list are, whatever its time stamps say. Line i of one list belongs to
    /// line i of the others.
    File,
}

impl FrameOrder {
    /// Names on the command line.
    pub const NAMES: [&str; 2] = ["time", "file"];

    /// From its name.
    pub fn named(name: &str) -> Option<FrameOrder> {
        match name {
            "time" => Some(FrameOrder::Time),
            "file" => Some(FrameOrder::File),
            _ => None,
        }
    }
}
