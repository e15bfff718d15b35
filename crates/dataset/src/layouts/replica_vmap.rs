//! Replica in the render of vMAP and SNI-SLAM.
use super::{
    interface::{LayoutFiles, Mark, Parts},
    replica,
    wanted::Wanted,
};
use crate::{
    entries::Entries,
    folder::{COLOR_ENDS, Folder},
};
use mte_slam_types::sequence::SequenceError;

pub(super) struct ReplicaVmap;

impl LayoutFiles for ReplicaVmap {
    fn name(&self) -> &'static str {
        "replica-vmap"
    }

    fn parts(&self) -> Parts {
        Parts {
            about: "vMAP's render",
            color: "`rgb/rgb_0.png`",
            depth: "`depth/depth_0.png`, mm",
            poses: "`traj.txt`, `traj_w_c.txt`",
            labels: "`semantic_class/`",
        }
    }

    fn marks(&self, folder: &Folder, _camera_given: bool) -> Vec<Mark> {
        vec![
            ("rgb/rgb_<number>.png|jpg", folder.count("rgb/rgb_", &COLOR_ENDS)),
            ("depth/depth_<number>.png", folder.count("depth/depth_", &[".png"])),
        ]
    }

    fn read(&self, folder: &Folder, wanted: &Wanted) -> Result<Entries, SequenceError> {
        let colors = folder.numbered("rgb/rgb_", &COLOR_ENDS)?;
        let depths = folder.numbered("depth/depth_", &[".png"])?;
        replica::read(folder, colors, depths, "depth/depth_", 1e-3, wanted)
    }
}
