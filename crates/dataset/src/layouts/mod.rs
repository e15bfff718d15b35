//! The layouts of recordings and how they are recognised.
//!
//! To add a layout: a file here with a type that implements [`LayoutFiles`], its `mod` line, and
//! its line in the registry below. Names and errors follow; a test compares the tables of the
//! documentation (`layouts.md`, and the guide's) with what the layouts say of themselves.
mod images;
mod interface;
mod nerfstudio;
mod polycam;
mod replica;
mod replica_vmap;
mod scannet;
mod sens;
mod seven_scenes;
mod stamps;
mod stray;
mod tum;
#[cfg(test)]
mod tum_tests;
mod wanted;

use crate::{entries::Entries, folder::Folder};
use core::{fmt, str::FromStr};
use interface::LayoutFiles;
use mte_slam_types::sequence::SequenceError;
pub(crate) use wanted::Wanted;

/// Makes [`Layout`] of lines `Variant: Type, "documentation";`.
macro_rules! registry {
    ($($layout:ident: $files:path, $text:literal;)+) => {
        /// How a recording's files are laid out.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum Layout {
            $(#[doc = $text] $layout,)+
        }

        impl Layout {
            /// All layouts.
            pub const ALL: [Layout; [$($text),+].len()] = [$(Layout::$layout),+];

            fn files(self) -> &'static dyn LayoutFiles {
                match self {
                    $(Layout::$layout => &$files,)+
                }
            }
        }
    };
}

registry! {
    ReplicaNice: replica::Replica, "Replica in the render of NICE-SLAM.";
    ReplicaVmap: replica_vmap::ReplicaVmap, "Replica in the render of vMAP and SNI-SLAM.";
    Tum: tum::Tum, "TUM RGB-D.";
    SevenScenes: seven_scenes::SevenScenes, "7-Scenes.";
    ScanNet: scannet::ScanNet, "ScanNet, exported.";
    Sens: sens::Sens, "ScanNet, packed: one `.sens` file.";
    Nerfstudio: nerfstudio::Nerfstudio, "nerfstudio's `transforms.json`, with depth.";
    Stray: stray::Stray, "Stray Scanner, with the frames of its film taken out.";
    Polycam: polycam::Polycam, "Polycam's raw export.";
    Images: images::Images, "Any folders of images with a camera; taken when nothing else fits.";
}

impl Layout {
    /// Returns the name on the command line.
    pub fn name(self) -> &'static str {
        self.files().name()
    }

    /// Returns the names of all layouts, separated by commas.
    pub fn names() -> String {
        Layout::ALL.map(Layout::name).join(", ")
    }

    /// Returns a table of all layouts in Markdown: where each has its parts.
    pub fn table() -> String {
        let mut table = String::from(
            "| layout | color | depth | poses | labels |\n| --- | --- | --- | --- | --- |\n",
        );
        for layout in Layout::ALL {
            let parts = layout.files().parts();
            let cells = [parts.color, parts.depth, parts.poses, parts.labels].join(" | ");
            let about = match parts.about {
                "" => String::new(),
                about => format!(" ({about})"),
            };
            table += &format!("| `{layout}`{about} | {cells} |\n");
        }
        table
    }

    /// Reads everything but the images.
    pub(super) fn read(self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
        self.files().read(folder, wanted)?.completed(folder, wanted.camera.as_ref())
    }

    fn fits(self, folder: &Folder, camera_given: bool) -> bool {
        self.files().marks(folder, camera_given).iter().all(|(_, n)| *n > 0)
    }

    fn report(self, folder: &Folder, camera_given: bool) -> String {
        let marks = self.files().marks(folder, camera_given);
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
            if fitting.len() > 1 {
                fitting.retain(|l| !l.files().is_last_resort());
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
                folder.notes().iter().for_each(|note| reason += &format!(" ({note})"));
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
        let named = Layout::ALL.into_iter().find(|l| l.name() == s);
        named.ok_or_else(|| format!("no layout {s:?}; there are {}", Layout::names()))
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
        assert!(Layout::names().starts_with("replica, replica-vmap, tum, 7scenes, scannet"));
        assert!("scanet".parse::<Layout>().unwrap_err().contains("7scenes"));
    }

    #[test]
    fn the_documentation_lists_every_layout() {
        let shown = include_str!("../layouts.md");
        assert_eq!(shown, Layout::table(), "crates/dataset/src/layouts.md is not the table");
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
