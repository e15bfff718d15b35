//! Options of `eval`, and its manual: what each figure means.
use super::{ClassArgs, EngineArgs};
use clap::{Args, ValueEnum, ValueHint};
use std::path::PathBuf;

/// The long help of `eval`.
pub const EVAL_MANUAL: &str = "Compute the figures of an output folder again, from trajectory.txt, \
renders/ and mesh.ply and the recording they came from; no engine is started (but for novel \
views and --miou-protocol sni, which render the map of checkpoint.safetensors). Writes OUT/eval.json and \
prints the table. Works for files of other programs too, if they follow the same formats.

Figures and their protocols (in brackets their section in metrics.json and eval.json):
    ATE RMSE [trajectory]         translation, all frames with a finite true pose, lost ones
                                  included; SE(3) alignment by Umeyama without scale, and unaligned
    depth L1, views [depth]       rendered at estimated poses, without depth input, against the
                                  sensor's depth; pixels with both
    PSNR, views [color]           the same views, 8-bit sRGB, mean over the images
    mIoU [semantics]              the same views: one confusion matrix over all, classes with
                                  union > 0; pixel accuracy, IoU and boundaries of each class
    SNI-SLAM's mIoU [semantics_sni]   the first frame alone, at its true pose and with its true depth,
                                  as SNI-SLAM's script does; for comparison only
    novel views [novel_views]     mIoU, depth and PSNR at poses that the map never saw
    mesh accuracy, completion, completion ratio < 5 cm
        [mesh_coslam]             Co-SLAM's culling: a face stays if a vertex is in a frame's frustum,
                                  and a vertex is less than 3 cm behind a rendering of the mesh itself
                                  in a frame or in one of 100 virtual views (from free space that a
                                  frame sees, in random directions)
        [mesh]                    ESLAM's: a vertex is in a frame and no deeper than its measured
                                  depth plus 6 cm
        [mesh_frustum]            NICE-SLAM's: a vertex is in a frame's frustum (--cull frustum)
                                  Both meshes are culled alike. 200,000 samples per mesh; point to
                                  point as the peers, beside it the floor that such sampling has
                                  and the exact distances to the surface. --icp aligns first
    depth L1, mesh [mesh_depth]   both meshes, culled as Co-SLAM's, in 1000 virtual views of 500x500,
                                  f 300, far 20 m, inside the true mesh's box times (0.3, 0.7, 0.7)
                                  + 0.4 m in z, views that hold unseen true points rejected, pixels
                                  0 < true < 19 m. Another figure than depth L1, views
    time, memory [time, memory]   in metrics.json alone: median and 95th percentile per frame; without
                                  reading and decoding images, evaluation, and the last optimisation,
                                  which is given apart

Example:
    mte-slam eval out/room0-replica data/room0 --mesh data/room0_mesh.ply --icp";

/// `eval`.
#[derive(Debug, Args)]
pub struct EvalArgs {
    /// Output folder of a run.
    #[arg(value_name = "OUT", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// The recording it came from.
    #[arg(value_name = "DATASET", value_hint = ValueHint::DirPath)]
    pub dataset: PathBuf,
    /// Ground-truth mesh to compare with [default: mesh.ply in the recording's folder, if there].
    #[arg(long, value_name = "GT.ply", value_hint = ValueHint::FilePath)]
    pub mesh: Option<PathBuf>,
    /// Layout of the recording's files, instead of recognising it.
    #[arg(long, value_name = "LAYOUT")]
    pub layout: Option<String>,
    /// Which parts of the two meshes are compared; one or several.
    #[arg(
        long,
        value_enum,
        value_name = "PROTOCOLS",
        value_delimiter = ',',
        default_values_t = [CullChoice::Coslam, CullChoice::Eslam]
    )]
    pub cull: Vec<CullChoice>,
    /// Align our mesh to the true one first (point-to-point ICP, 0.1 m), as the peers do.
    #[arg(long)]
    pub icp: bool,
    /// Virtual views of depth L1 of the mesh; 0 leaves it out.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    pub mesh_views: usize,
    /// Seed of surface samples and virtual views.
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub eval_seed: u32,
    /// Write the real and virtual views that the mesh was judged in to a JSON file, for other
    /// programs to repeat the figures.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub write_views: Option<PathBuf>,
    /// How rendered classes are scored.
    #[arg(long, value_enum, default_value_t, value_name = "PROTOCOL")]
    pub miou_protocol: MiouProtocol,
    /// Render the frames again from OUT/checkpoint.safetensors, with classes by the nearest anchor or
    /// by the class head, and score these as well: what the run itself did not choose.
    #[arg(long, value_name = "anchors|head")]
    pub inference: Option<InferenceChoice>,
    /// Recording of views that the run has not seen, in the same world as DATASET: the map of
    /// OUT/checkpoint.safetensors is rendered at its poses [default: DATASET/novel, if there].
    #[arg(long, value_name = "DATASET", value_hint = ValueHint::AnyPath)]
    pub novel: Option<PathBuf>,
    /// Labels to compare with: `dataset` (the recording's own), a folder of label images, or
    /// `none` [default: the recording's own, if it has any, else those of --labels].
    #[arg(long, value_name = "dataset|DIR|none")]
    pub truth_labels: Option<String>,
    /// Labels that the run was given, to be scored too [default: as its config.toml says].
    #[arg(long, value_name = "none|dataset|DIR")]
    pub labels: Option<String>,
    /// What the ids mean [default: as config.toml says].
    #[command(flatten)]
    pub classes: ClassArgs,
    /// Engine, where the map is rendered.
    #[command(flatten)]
    pub engine: EngineArgs,
}

/// Which parts of a mesh count as observed; both meshes are culled alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CullChoice {
    /// In a frame, and no deeper than its measured depth plus 6 cm (ESLAM).
    Eslam,
    /// In a frame's frustum, and visible in a rendering of the mesh itself (3 cm) in a frame or a
    /// virtual view (Co-SLAM).
    Coslam,
    /// In a frame's frustum, hidden or not (NICE-SLAM).
    Frustum,
}

/// What gives a rendered pixel its class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum InferenceChoice {
    /// The nearest anchor.
    Anchors,
    /// The class head.
    Head,
}

/// How rendered classes are scored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum MiouProtocol {
    /// All rendered frames, at estimated poses, without depth.
    #[default]
    Full,
    /// Beside that the first frame alone, at its true pose, with its true depth, as SNI-SLAM's
    /// script does; for comparison only.
    Sni,
}
