//! Protocols: how a figure was measured, as an id to join by and a sentence to read.
//!
//! Figures share a column, a mean or a comparison only where their ids are equal. Sentences are for
//! people: they may hold counts of a run, and may be reworded. An id is `FAMILY/VARIANT@VERSION`; the
//! version rises with every change after which figures no longer compare with those from before.
//! Files hold both, as `protocol_id` and `protocol`.
use mte_slam_metrics::protocol;
use serde::{Deserialize, Serialize, Serializer, ser::SerializeStruct};

/// Which parts of two meshes are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Culling {
    /// ESLAM's: in a frame, and no deeper than its measured depth plus 6 cm.
    Eslam,
    /// Co-SLAM's: in a frame's frustum, and visible in a rendering of the mesh itself.
    Coslam,
    /// NICE-SLAM's: in a frame's frustum, hidden or not.
    Frustum,
}

/// Every protocol of `metrics.json`, and those of the paper's tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
#[non_exhaustive]
pub enum Protocol {
    /// Trajectory error.
    Trajectory,
    /// How frames were rendered for the figures of views.
    Renders,
    /// Depth of rendered views.
    DepthViews,
    /// Colour of rendered views.
    ColorViews {
        /// Whether the input was resampled to the depth camera, as the map was trained.
        resampled: bool,
    },
    /// Classes of rendered views.
    Classes,
    /// Outlines of classes.
    Boundary,
    /// Classes of one frame, as SNI-SLAM's script has them.
    Sni,
    /// Classes of a surface from one view to the next.
    Consistency,
    /// Views that a built-in scene gives near rendered frames.
    NovelNearFrames,
    /// Views of another recording in the same world.
    NovelRecording,
    /// Statistics of the redundancy suppressor.
    Anchors,
    /// Accuracy and completion of a mesh.
    Surface {
        /// Which parts of the meshes.
        culling: Culling,
        /// Whether the mesh was aligned to the true one first.
        icp: bool,
    },
    /// Depth of a mesh in virtual views, culled as Co-SLAM's.
    MeshDepth {
        /// Views asked for.
        views: usize,
        /// Whether the mesh was aligned to the true one first.
        icp: bool,
    },
    /// Time per frame.
    Time,
    /// Memory.
    Memory,
    /// The paper's Table I.
    PaperAteScanNet,
    /// The paper's Table II.
    PaperAteReplica,
    /// The paper's Table III.
    PaperReconstruction,
    /// The paper's Table IV.
    PaperMiou,
    /// The paper's Table V.
    PaperRuntime,
    /// The paper's Table VI.
    PaperAblation,
}

/// An id that names no protocol.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("protocol: found the id `{0}`, expected one of a known protocol, such as `ate/rigid@1`")]
pub struct UnknownProtocol(pub String);

impl Protocol {
    /// Every protocol; those with a count once, with the usual one.
    pub const ALL: [Protocol; 27] = [
        Protocol::Trajectory,
        Protocol::Renders,
        Protocol::DepthViews,
        Protocol::ColorViews { resampled: false },
        Protocol::ColorViews { resampled: true },
        Protocol::Classes,
        Protocol::Boundary,
        Protocol::Sni,
        Protocol::Consistency,
        Protocol::NovelNearFrames,
        Protocol::NovelRecording,
        Protocol::Anchors,
        Protocol::Surface { culling: Culling::Eslam, icp: false },
        Protocol::Surface { culling: Culling::Eslam, icp: true },
        Protocol::Surface { culling: Culling::Coslam, icp: false },
        Protocol::Surface { culling: Culling::Coslam, icp: true },
        Protocol::Surface { culling: Culling::Frustum, icp: false },
        Protocol::Surface { culling: Culling::Frustum, icp: true },
        Protocol::MeshDepth { views: 1000, icp: false },
        Protocol::Time,
        Protocol::Memory,
        Protocol::PaperAteScanNet,
        Protocol::PaperAteReplica,
        Protocol::PaperReconstruction,
        Protocol::PaperMiou,
        Protocol::PaperRuntime,
        Protocol::PaperAblation,
    ];

    /// The id, `FAMILY/VARIANT@VERSION`.
    pub fn id(self) -> String {
        let name = match self {
            Protocol::Trajectory => protocol::ATE,
            Protocol::Renders => "renders/estimated-poses@1",
            Protocol::DepthViews => protocol::DEPTH_VIEWS,
            Protocol::ColorViews { resampled: false } => protocol::PSNR_VIEWS,
            Protocol::ColorViews { resampled: true } => "psnr/views-resampled@1",
            Protocol::Classes => protocol::MIOU,
            Protocol::Boundary => protocol::BOUNDARY,
            Protocol::Sni => "miou/sni-first-frame@1",
            Protocol::Consistency => protocol::CONSISTENCY,
            Protocol::NovelNearFrames => "novel/near-frames@1",
            Protocol::NovelRecording => "novel/recording@1",
            Protocol::Anchors => "anchors/after-calls@1",
            Protocol::Surface { culling, icp } => match (culling, icp) {
                (Culling::Eslam, false) => "surface/eslam@1",
                (Culling::Eslam, true) => "surface/eslam-icp@1",
                (Culling::Coslam, false) => "surface/coslam@1",
                (Culling::Coslam, true) => "surface/coslam-icp@1",
                (Culling::Frustum, false) => "surface/frustum@1",
                (Culling::Frustum, true) => "surface/frustum-icp@1",
            },
            Protocol::MeshDepth { views, icp: false } => return protocol::depth_virtual(views),
            Protocol::MeshDepth { views, icp: true } => {
                return format!("depth-l1/virtual-{views}-icp@1");
            }
            Protocol::Time => "time/per-frame@1",
            Protocol::Memory => "memory/peak@1",
            Protocol::PaperAteScanNet => "paper/ate-scannet@1",
            Protocol::PaperAteReplica => "paper/ate-replica@1",
            Protocol::PaperReconstruction => "paper/reconstruction@1",
            Protocol::PaperMiou => "paper/miou@1",
            Protocol::PaperRuntime => "paper/runtime@1",
            Protocol::PaperAblation => "paper/ablation@1",
        };
        name.to_owned()
    }

    /// The protocol of an id; of those with a count any count is known.
    pub fn of_id(id: &str) -> Option<Protocol> {
        if let Some(rest) = id.strip_prefix("depth-l1/virtual-") {
            let rest = rest.strip_suffix("@1")?;
            let (views, icp) = match rest.strip_suffix("-icp") {
                Some(views) => (views, true),
                None => (rest, false),
            };
            return Some(Protocol::MeshDepth { views: views.parse().ok()?, icp });
        }
        Protocol::ALL.into_iter().find(|p| p.id() == id)
    }

    /// What it is, in a sentence. Where figures say more (how many views there were, how meshes were
    /// culled), their own sentence replaces this one.
    pub fn sentence(self) -> &'static str {
        match self {
            Protocol::Trajectory => "translation after a rigid alignment, frames with a true pose",
            Protocol::Renders => "at estimated poses, without depth input",
            Protocol::DepthViews => "rendered depth against the sensor's, pixels with both",
            Protocol::ColorViews { .. } => "rendered colour against the input's, 8-bit sRGB",
            Protocol::Classes => "rendered classes against true labels, all images together",
            Protocol::Boundary => "outlines of classes within 3 pixels",
            Protocol::Sni => {
                "SNI-SLAM's script: the first frame alone, at its true pose and with its true \
                 depth; for comparison with that paper only"
            }
            Protocol::Consistency => {
                "share of surface points whose class differs in the next view; needs no truth"
            }
            Protocol::NovelNearFrames => "views ray-cast from the scene, near rendered frames",
            Protocol::NovelRecording => "views of a recording that the map has not seen",
            Protocol::Anchors => {
                "after each call of the optimisation: last frame, anchors in use, and since the \
                 start spawned, dropped, merged"
            }
            Protocol::Surface { .. } => "samples of two meshes, both culled alike",
            Protocol::MeshDepth { .. } => "depth of two meshes in virtual views",
            Protocol::Time => {
                "wall clock per frame, median and 95th percentile; without reading and decoding \
                 images, without evaluation, and without the last optimisation, which is given \
                 apart. The first frame is not tracked; its mapping may compile pipelines"
            }
            Protocol::Memory => {
                "host: peak resident set of the whole program, evaluation included (without a \
                 hardware adapter it holds the device's buffers, too); device: sum of the \
                 engine's buffers, without the driver's own"
            }
            Protocol::PaperAteScanNet => {
                "ATE RMSE of the camera pose against BundleFusion's, mean of 5 runs; the paper does \
                 not say how trajectories are aligned"
            }
            Protocol::PaperAteReplica => {
                "ATE RMSE of the camera pose against the simulation's, mean of 5 runs; the paper \
                 does not say how trajectories are aligned"
            }
            Protocol::PaperReconstruction => {
                "culling and evaluation of Co-SLAM, completion ratio below 5 cm, mesh of 0.01 m, \
                 mean of 5 runs"
            }
            Protocol::PaperMiou => {
                "mIoU, mean of 5 runs; the paper does not say over which frames or at which poses \
                 (SNI-SLAM's released script takes one frame at its true pose with true depth)"
            }
            Protocol::PaperRuntime => {
                "average processing time per frame on an NVIDIA RTX 4090; the first five methods are \
                 without semantics"
            }
            Protocol::PaperAblation => {
                "mIoU as in Table IV. The paper's text gives 82.16 to the run with the suppressor, \
                 its table to the one without it"
            }
        }
    }
}

/// As the fields `protocol` and `protocol_id`, to be flattened into the object of the figures.
impl Serialize for Protocol {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct("Protocol", 2)?;
        fields.serialize_field("protocol_id", &self.id())?;
        fields.serialize_field("protocol", self.sentence())?;
        fields.end()
    }
}

impl TryFrom<String> for Protocol {
    type Error = UnknownProtocol;

    fn try_from(id: String) -> Result<Protocol, UnknownProtocol> {
        Protocol::of_id(&id).ok_or(UnknownProtocol(id))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_protocol_has_an_id_of_its_own() {
        let ids: BTreeSet<String> = Protocol::ALL.iter().map(|p| p.id()).collect();
        assert_eq!(ids.len(), Protocol::ALL.len());
        for protocol in Protocol::ALL {
            let id = protocol.id();
            assert_eq!(Protocol::of_id(&id), Some(protocol));
            let (family, rest) = id.split_once('/').unwrap();
            let (variant, version) = rest.split_once('@').unwrap();
            assert!(!family.is_empty() && !variant.is_empty(), "{id}");
            assert!(version.parse::<u32>().unwrap() >= 1, "{id}");
            assert!(!protocol.sentence().is_empty());
        }
        let other = Protocol::MeshDepth { views: 30, icp: true };
        assert_eq!(Protocol::of_id("depth-l1/virtual-30-icp@1"), Some(other));
        assert_eq!(Protocol::of_id("depth-l1/virtual-many@1"), None);
        let unknown = Protocol::try_from("ate/rigid@9".to_owned()).unwrap_err().to_string();
        assert!(unknown.contains("`ate/rigid@9`") && unknown.contains("expected"), "{unknown}");
    }

    #[test]
    fn both_forms_are_written() {
        let json = serde_json::to_value(Protocol::Sni).unwrap();
        assert_eq!(json["protocol_id"], "miou/sni-first-frame@1");
        assert!(json["protocol"].as_str().unwrap().starts_with("SNI-SLAM's script"));
    }
}
