//! The folder layouts and how they are recognised.
use super::{folder::Folder, images, intrinsics::IMAGES_CAMERA, nerfstudio, sens};
use core::{fmt, str::FromStr};
use mte_slam_types::sequence::SequenceError;

/// How a recording's files are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Replica in the render of NICE-SLAM: `results/frame000000.jpg`, `results/depth000000.png`.
    ReplicaNice,
    /// Replica in the render of vMAP and SNI-SLAM: `rgb/rgb_0.png`, `depth/depth_0.png`.
    ReplicaVmap,
    /// TUM RGB-D: `rgb.txt`, `depth.txt`.
    Tum,
    /// 7-Scenes: `frame-000000.color.png`, `frame-000000.depth.png`.
    SevenScenes,
    /// ScanNet, exported: `color/0.jpg`, `depth/0.png`, `pose/0.txt`, `intrinsic/`.
    ScanNet,
    /// ScanNet, packed: one `.sens` file.
    Sens,
    /// nerfstudio's `transforms.json`, with depth.
    Nerfstudio,
    /// Any folders of colour and depth images with a camera given; taken when nothing else fits.
    Images,
}

pub(super) const COLOR_ENDS: [&str; 3] = [".jpg", ".png", ".jpeg"];
pub(super) const SEVEN_COLOR_ENDS: [&str; 3] = [".color.png", ".color.jpg", ".color.jpeg"];

impl Layout {
    /// All layouts.
    pub const ALL: [Layout; 8] = [
        Layout::ReplicaNice,
        Layout::ReplicaVmap,
        Layout::Tum,
        Layout::SevenScenes,
        Layout::ScanNet,
        Layout::Sens,
        Layout::Nerfstudio,
        Layout::Images,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Layout::ReplicaNice => "replica",
            Layout::ReplicaVmap => "replica-vmap",
            Layout::Tum => "tum",
            Layout::SevenScenes => "7scenes",
            Layout::ScanNet => "scannet",
            Layout::Sens => "sens",
            Layout::Nerfstudio => "nerfstudio",
            Layout::Images => "images",
        }
    }

    /// The files that mark the layout: what they look like, and how many there are.
    fn marks(self, folder: &Folder, camera_given: bool) -> Vec<(&'static str, usize)> {
        match self {
            Layout::ReplicaNice => vec![
                ("results/frame<number>.jpg|png", folder.count("results/frame", &COLOR_ENDS)),
                ("results/depth<number>.png", folder.count("results/depth", &[".png"])),
            ],
            Layout::ReplicaVmap => vec![
                ("rgb/rgb_<number>.png|jpg", folder.count("rgb/rgb_", &COLOR_ENDS)),
                ("depth/depth_<number>.png", folder.count("depth/depth_", &[".png"])),
            ],
            Layout::Tum => vec![
                ("rgb.txt", folder.has("rgb.txt").into()),
                ("depth.txt", folder.has("depth.txt").into()),
            ],
            Layout::SevenScenes => vec![
                ("frame-<number>.color.png|jpg", folder.count("frame-", &SEVEN_COLOR_ENDS)),
                ("frame-<number>.depth.png", folder.count("frame-", &[".depth.png"])),
            ],
            Layout::ScanNet => vec![
                ("color/<number>.jpg|png", folder.count("color/", &COLOR_ENDS)),
                ("depth/<number>.png", folder.count("depth/", &[".png"])),
                ("pose/<number>.txt", folder.count("pose/", &[".txt"])),
            ],
            Layout::Sens => vec![("<name>.sens", sens::files_of(folder).len())],
            Layout::Nerfstudio => vec![(nerfstudio::FILE, folder.has(nerfstudio::FILE).into())],
            Layout::Images => {
                let camera = camera_given || folder.has(IMAGES_CAMERA);
                vec![
                    ("color|rgb|images/<name>.jpg|png", images::colors(folder).len()),
                    ("depth/<name>.png", images::depths(folder).len()),
                    ("intrinsics.json (or a camera given)", camera.into()),
                ]
            }
        }
    }

    fn fits(self, folder: &Folder, camera_given: bool) -> bool {
        self.marks(folder, camera_given).iter().all(|(_, n)| *n > 0)
    }

    fn report(self, folder: &Folder, camera_given: bool) -> String {
        let marks = self.marks(folder, camera_given);
        let marks: Vec<String> = marks.iter().map(|(m, n)| format!("{m} (found {n})")).collect();
        format!("{self} needs {}", marks.join(" and "))
    }

    /// Finds the layout, going into the one sub-folder that holds everything if there is one.
    /// A wanted layout is only checked.
    pub(super) fn detect(
        folder: &mut Folder,
        wanted: Option<Layout>,
        camera_given: bool,
    ) -> Result<Layout, SequenceError> {
        let name = folder.name();
        let mut reason = String::new();
        loop {
            let candidates: Vec<Layout> = match wanted {
                Some(layout) => vec![layout],
                None => Layout::ALL.into(),
            };
            let mut fitting: Vec<Layout> =
                candidates.iter().copied().filter(|l| l.fits(folder, camera_given)).collect();
            // Most recordings with a list or poses of their own are such folders, too.
            if fitting.len() > 1 {
                fitting.retain(|l| *l != Layout::Images);
            }
            match fitting.as_slice() {
                [one] => return Ok(*one),
                [] => {}
                several => {
                    let names: Vec<&str> = several.iter().map(|l| l.name()).collect();
                    let names = names.join(", ");
                    let reason = format!("several fit ({names}); name the one that is meant");
                    return Err(SequenceError::UnknownLayout { folder: name, reason });
                }
            }
            if reason.is_empty() {
                let files = folder.names().count();
                let reports: Vec<String> =
                    candidates.iter().map(|l| l.report(folder, camera_given)).collect();
                reason = match files {
                    0 => "the folder is empty".into(),
                    _ => format!("of {files} files: {}", reports.join("; ")),
                };
            }
            if !folder.descend() {
                return Err(SequenceError::UnknownLayout { folder: name, reason });
            }
        }
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Layout {
    type Err = String;

    /// From the name on the command line; the error lists the names.
    fn from_str(s: &str) -> Result<Self, String> {
        Layout::ALL.into_iter().find(|l| l.name() == s).ok_or_else(|| {
            let names: Vec<&str> = Layout::ALL.iter().map(|l| l.name()).collect();
            format!("no layout {s:?}; there are {}", names.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MemorySource;

    fn detect(names: &[&str], wanted: Option<Layout>) -> Result<Layout, SequenceError> {
        let mut m = MemorySource::new("here");
        for n in names {
            m.insert(*n, "");
        }
        Layout::detect(&mut Folder::new(Box::new(m)).unwrap(), wanted, false)
    }

    #[test]
    fn names_round_trip() {
        for layout in Layout::ALL {
            assert_eq!(layout.to_string().parse(), Ok(layout));
        }
        assert!("scanet".parse::<Layout>().unwrap_err().contains("7scenes"));
    }

    #[test]
    fn each_layout_is_known_by_its_files() {
        let nice = ["results/frame000000.jpg", "results/depth000000.png"];
        let vmap = ["imap/00/rgb/rgb_0.png", "imap/00/depth/depth_0.png"];
        let seven = ["frame-000000.color.jpg", "frame-000000.depth.png", "rgb.txt"];
        assert_eq!(detect(&nice, None).unwrap(), Layout::ReplicaNice);
        assert_eq!(detect(&vmap, None).unwrap(), Layout::ReplicaVmap);
        assert_eq!(detect(&["rgb.txt", "depth.txt"], None).unwrap(), Layout::Tum);
        assert_eq!(detect(&seven, None).unwrap(), Layout::SevenScenes);
        assert_eq!(detect(&seven, Some(Layout::SevenScenes)).unwrap(), Layout::SevenScenes);
        let scannet =
            ["scans/scene/color/0.jpg", "scans/scene/depth/0.png", "scans/scene/pose/0.txt"];
        assert_eq!(detect(&scannet, None).unwrap(), Layout::ScanNet);
        assert_eq!(detect(&["scene/scene.sens"], None).unwrap(), Layout::Sens);
        let capture = ["transforms.json", "images/0.png", "depth/0.png", "intrinsics.json"];
        assert_eq!(detect(&capture, None).unwrap(), Layout::Nerfstudio);
        assert_eq!(detect(&capture[1..], None).unwrap(), Layout::Images);
        assert!(detect(&capture[1..3], None).unwrap_err().to_string().contains("intrinsics.json"));
    }

    #[test]
    fn what_does_not_fit_is_explained() {
        let e = detect(&[], None).unwrap_err().to_string();
        assert!(e.contains("here") && e.contains("empty"), "{e}");
        let e = detect(&["results/frame000000.jpg"], None).unwrap_err().to_string();
        assert!(e.contains("results/depth<number>.png (found 0)"), "{e}");
        assert!(e.contains("tum needs rgb.txt (found 0)"), "{e}");
        let both = ["rgb.txt", "depth.txt", "rgb/rgb_0.png", "depth/depth_0.png"];
        let e = detect(&both, None).unwrap_err().to_string();
        assert!(e.contains("several fit (replica-vmap, tum)"), "{e}");
        assert_eq!(detect(&both, Some(Layout::Tum)).unwrap(), Layout::Tum);
        let e = detect(&["rgb.txt", "depth.txt"], Some(Layout::ReplicaNice)).unwrap_err();
        assert!(!e.to_string().contains("tum needs"), "{e}");
    }
}
