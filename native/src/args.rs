//! The command line as clap reads it. The texts here are the program's manual, so they teach:
//! what a command does, what it writes, and an example to copy.
mod engine;
mod evaluation;
mod objects;
mod recording;
mod segmentation;
mod suite;
mod values;

use crate::invocation::Invocation;
pub use engine::{EngineArgs, EngineChoice};
pub use evaluation::{CullChoice, EvalArgs, InferenceChoice, MiouProtocol};
pub use objects::ObjectsArgs;
pub use recording::{
    ClassArgs, ColorChoice, ConvertArgs, InspectArgs, LabelArgs, SelectionArgs, SensorArgs,
    TargetLayout,
};
pub use segmentation::{SegmenterArgs, turn, turn_name};
pub use suite::EvaluateArgs;

use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint};
use mte_slam_types::pose::Pose;
use std::path::PathBuf;
use values::{at_least_one, picture_width, pose, positive_metres};

/// Neural RGB-D semantic SLAM on any GPU, or none.
#[derive(Debug, Parser)]
#[command(
    name = "mte-slam",
    version,
    arg_required_else_help = true,
    about = "Neural RGB-D semantic SLAM on any GPU, or none",
    long_about = "Neural RGB-D semantic SLAM on any GPU, or none.\n\n\
        A recording of colour and depth images goes in; the camera's path, a coloured mesh (with \
        classes where there are labels), pictures rendered from the map and metrics come out.\n\n\
        Start with the built-in sequence, which needs no data:\n\n    \
        mte-slam demo\n\n\
        then with your own recording (Replica, ScanNet, TUM RGB-D, 7-Scenes, nerfstudio, or a folder \
        of images):\n\n    \
        mte-slam inspect path/to/recording\n    \
        mte-slam run path/to/recording --out out/mine\n    \
        mte-slam mesh out/mine --resolution 0.01",
    after_help = "Exit codes: 0 done, 1 something failed while working, 2 the command line or \
        configuration is wrong."
)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Print nothing but errors (and, with --json, the figures).
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Print the figures as JSON on stdout and nothing else there; progress stays on stderr.
    #[arg(long, global = true)]
    pub json: bool,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run the built-in sequence: a furnished room, with labels and a true mesh
    #[command(
        long_about = "Run SLAM on the built-in sequence, a procedurally made furnished room with \
        labels and a true mesh, and write trajectory, metrics, mesh and pictures. Needs no data, no \
        network and no GPU (without one it says so and computes on the processor).\n\nExamples:\n    \
        mte-slam demo\n    \
        mte-slam demo --frames 20 --engine cpu --out out/quick"
    )]
    Demo(DemoArgs),
    /// Run SLAM on a recording and write trajectory, metrics, mesh and pictures
    #[command(
        long_about = "Run SLAM on a recording: a folder, a .zip of one, or a .sens. The layout is \
        recognised by the files:\n    \
        replica        results/frame000000.jpg, results/depth000000.png, traj.txt (NICE-SLAM's render)\n    \
        replica-vmap   rgb/rgb_0.png, depth/depth_0.png, traj.txt (vMAP's render)\n    \
        tum            rgb.txt, depth.txt, groundtruth.txt\n    \
        7scenes        frame-000000.color.png, .depth.png, .pose.txt\n    \
        scannet        color/0.jpg, depth/0.png, pose/0.txt, intrinsic/, label-filt/ (exported)\n    \
        sens           one .sens file (ScanNet, packed), label-filt/ beside it\n    \
        nerfstudio     transforms.json with depth_file_path\n    \
        images         color/ (rgb/, images/) and depth/ with any numbered names, 16-bit PNG depth in\n                   \
        mm, and intrinsics.json, {\"fx\": .., \"fy\": .., \"cx\": .., \"cy\": ..} with, if wanted,\n                   \
        w, h, depth_scale (units per metre), k1 k2 p1 p2 k3; or --camera instead of it.\n                   \
        Poses, if any: pose/0.txt, or traj.txt or poses.txt with 16 numbers per line\n    \
        ScanNet's raw label ids become NYU's 40 classes where scannetv2-labels.combined.tsv lies in the\n    \
        folder or up to two above. `mte-slam inspect` says what is recognised and whether it fits.\n\n\
        The output folder receives:\n    \
        trajectory.txt       time stamp, position [m] and quaternion of world_from_camera (TUM format)\n    \
        trajectory_gt.txt    the same of the ground truth, where known\n    \
        trajectory.svg       both, from above and from the side\n    \
        metrics.json         every figure with its protocol\n    \
        timings.csv          seconds of each frame\n    \
        config.toml          the complete effective configuration; --config takes it back\n    \
        mesh.ply, mesh.glb   coloured; mesh_semantic.* in class colours, with ids (PLY) or one material per class (GLB)\n    \
        legend.png, confusion.png, classes.csv   the classes, with figures where there are true labels\n    \
        renders/             colour, depth [mm], classes (ids, and in colour) and a comparison sheet of every K-th frame\n    \
        checkpoint.safetensors   the map; `mesh` and `render` read it\n\n\
        Examples:\n    \
        mte-slam run data/room0\n    \
        mte-slam run data/rgbd_dataset_freiburg1_desk --preset tum --scale 0.5\n    \
        mte-slam run data/room0 --frames 100 --set mapping.iterations=20 --seed 7 --out out/try\n    \
        mte-slam run --resume out/try    (after an interruption)"
    )]
    Run(RunArgs),
    /// Compute the figures of an output folder again, from its files and the recording alone
    #[command(long_about = evaluation::EVAL_MANUAL)]
    Eval(EvalArgs),
    /// Extract the mesh of an output folder's map again, for example finer
    #[command(
        long_about = "Extract the mesh of an output folder's checkpoint again, at any resolution, \
        and replace OUT/mesh.ply, mesh.glb and (with classes) mesh_semantic.ply and .glb.\n\n\
        Example:\n    mte-slam mesh out/room0-replica --resolution 0.01"
    )]
    Mesh(MeshArgs),
    /// List the things in an output folder's mesh, with boxes, and write each as a part of its own
    #[command(long_about = objects::OBJECTS)]
    Objects(ObjectsArgs),
    /// Render colour, depth and classes of an output folder's map from any pose
    #[command(
        long_about = "Render colour, depth and classes from an output folder's checkpoint, without \
        any depth input: at the estimated pose of one frame (into OUT/renders), or at a pose or \
        along a path that no camera took (into OUT/views).\n\n\
        Examples:\n    mte-slam render out/room0-replica --frame 42\n    \
        mte-slam render out/room0-replica --pose \"0.5 -1 0.2  0 0 0 1\"\n    \
        mte-slam render out/room0-replica --path tour.txt"
    )]
    Render(RenderArgs),
    /// Write the built-in sequence to a folder, in Replica layout
    #[command(
        long_about = "Write a built-in sequence to a folder in Replica (NICE-SLAM) layout with \
        labels, camera, bounds, class list and true mesh.\n\n\
        Examples:\n    mte-slam synth data/room --frames 200 && mte-slam run data/room\n    \
        mte-slam synth data/hall --scene hall --frames 1860 --novel 20"
    )]
    Synth(SynthArgs),
    /// Say what a recording holds, and warn of the usual mistakes
    #[command(
        long_about = "Say what a recording holds: layout, frames, sizes, depth, poses, classes; and \
        warn, with the evidence, of the usual mistakes. Frames are moved into later ones by the true \
        poses, and the depth that arrives is compared with the depth measured there: under the \
        given unit of depth and reading of the poses, and under other usual ones (1000, 5000, \
        6553.5 units per metre; OpenGL's axes; inverse poses; quaternions with the scalar first; \
        poses in lexical order).\n\n\
        Examples:\n    mte-slam inspect data/room0\n    \
        mte-slam inspect scene0000_00.sens --json\n    \
        mte-slam inspect data/mine --camera \"525 525 319.5 239.5\" --depth-scale 5000"
    )]
    Inspect(InspectArgs),
    /// Label a recording by a segmentation network
    #[command(
        long_about = "Label a recording by a segmentation network of your choice (an ONNX file), and write \
        what `run --labels DIR` and other tools read: label images with the ids of the network's classes, \
        their names in classes.json, and how certain the network is.\n\n\
        The output folder receives:\n    \
        semantic_class_000000.png   ids of the classes, 16 bits; void where there is none\n    \
        confidence/000000.png       probability of the class, in 1/255\n    \
        classes.json                ids, names and colours\n\n\
        Examples:\n    \
        mte-slam label data/mine --segmenter models/segformer-b0 --out data/mine-labels\n    \
        mte-slam run data/mine --labels data/mine-labels\n    \
        mte-slam run data/mine --segmenter models/segformer-b0     (both at once)"
    )]
    Label(LabelArgs),
    /// Write a recording in another layout
    #[command(
        long_about = "Write a recording, as it is read (part, scale, camera, undistorted), in another \
        layout. Labels go to semantic_class/ with a classes.json, which every layout may have here.\n\n\
        Examples:\n    mte-slam convert scene0000_00.sens data/scene --to replica\n    \
        mte-slam convert data/room0 data/room0-tum --to tum --frames 100"
    )]
    Convert(ConvertArgs),
    /// Serve the page and a recording, frame by frame, to a browser on this machine
    #[command(
        long_about = "Serve the page and a recording to a browser on this machine. The recording is \
        read and decoded here, in any layout that `run` knows, and streamed frame by frame, no \
        faster than the browser uses it. Nothing else of the disk can be reached.\n\n\
        Examples:\n    mte-slam serve data/room0\n    mte-slam serve data/kitchen --scale 0.5 --port 9000"
    )]
    Serve(ServeArgs),
    /// Measure what feature fusion and redundancy suppressor bring: neither, each, both, over seeds
    #[command(
        long_about = "Run SLAM on a labelled recording with neither of the two semantic modules, \
        with multi-tier feature fusion (MTFF), with the feature redundancy suppressor (FRS), with \
        both, with both but without the fusion's local module, and with SNI-SLAM's perceptron on \
        every sample in place of all that, each over several seeds, and compare the classes rendered at estimated poses, \
        without depth input, with the true labels. It matters most where the labels that the map \
        learns from are imperfect (--labels): true labels leave the modules little to do.\n\n\
        The output folder receives:\n    \
        ablation.md     the tables: mean and standard deviation over the seeds, and parameters\n    \
        ablation.json   the same with every seed's figures and the IoU of every class\n    \
        runs/           a file a finished run; a second start takes up where the first one ended\n\n\
        Examples:\n    \
        mte-slam ablate data/room0 --labels segmented --rows neither,both\n    \
        mte-slam ablate data/room0 --labels segmented --seeds 3 --preset fast --frames 100 --out out/try"
    )]
    Ablate(AblateArgs),
    /// Run a suite, scenes x seeds x presets x ablations, and report it beside published figures
    #[command(long_about = suite::EVALUATE)]
    Evaluate(EvaluateArgs),
    /// List adapters, their limits, and which engine `auto` would take
    Info(InfoArgs),
    /// Measure the kernels: milliseconds per stage and per iteration
    #[command(
        long_about = "Measure tracking (2000 rays of 40 samples) and mapping (4000 rays of 40 \
        samples) iterations with three modalities, 16 channels and 52 classes in a bound of 5.3 x \
        2.9 x 2.9 m: milliseconds per stage and per iteration, after a warm-up.\n\n\
        Examples:\n    mte-slam bench\n    mte-slam bench --engine cpu --iterations 5"
    )]
    Bench(BenchArgs),
    /// Write every composed shader to a folder, for reading
    Shaders(ShadersArgs),
    /// List the settings with their defaults, units and ranges
    #[command(
        long_about = "List every setting that --set, --config and the page know, with its value in a \
        preset, its unit and its range.\n\n\
        Examples:\n    mte-slam settings\n    mte-slam settings rays --preset fast"
    )]
    Settings(SettingsArgs),
}

impl Command {
    /// The output flags of a run.
    pub fn output_mut(&mut self) -> Option<&mut OutputArgs> {
        match self {
            Command::Demo(args) => Some(&mut args.output),
            Command::Run(args) => Some(&mut args.output),
            _ => None,
        }
    }
}

/// How poses are tracked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TrackerChoice {
    /// Align points with the field's surface and colour (Gauss-Newton); the default of the presets.
    Align,
    /// Volume rendering and Adam, as in the paper.
    Render,
    /// Take the true poses: mapping alone.
    Truth,
}

/// Where the configuration comes from. Later ones win: preset, file, `--set`, the named flags.
#[derive(Clone, Debug, Default, Args)]
pub struct ConfigArgs {
    /// Configuration file (TOML): keys given there replace the preset's. A config.toml of an
    /// output folder repeats that run.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, help_heading = "Configuration")]
    pub config: Option<PathBuf>,
    /// Settings to start from: tiny, fast, replica, scannet or tum [default: by layout; demo: fast].
    #[arg(long, value_name = "PRESET", help_heading = "Configuration")]
    pub preset: Option<String>,
    /// Set one key, for example `mapping.iterations=30`; may be repeated. `mte-slam settings`
    /// lists all keys.
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = "Configuration")]
    pub set: Vec<String>,
    /// How poses are tracked [default: by preset].
    #[arg(long, value_enum, value_name = "TRACKER", help_heading = "Configuration")]
    pub tracker: Option<TrackerChoice>,
    /// Seed of every random choice; one seed on one adapter gives identical files.
    #[arg(long, value_name = "S", help_heading = "Configuration")]
    pub seed: Option<u32>,
}

/// What is written where.
#[derive(Clone, Debug, Args)]
pub struct OutputArgs {
    /// Output folder [default: out/DATASET-PRESET].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath, help_heading = "Output")]
    pub out: Option<PathBuf>,
    /// Write into a folder that holds other files (they stay).
    #[arg(long, help_heading = "Output")]
    pub force: bool,
    /// Render and evaluate every K-th frame; 0 renders none.
    #[arg(long, value_name = "K", default_value_t = 10, help_heading = "Output")]
    pub render_every: usize,
    /// Voxel size of the mesh in metres; `mte-slam mesh` can refine it later [default: by preset].
    #[arg(long, value_name = "M", value_parser = positive_metres, help_heading = "Output")]
    pub mesh_resolution: Option<f64>,
    /// Do not extract a mesh.
    #[arg(long, help_heading = "Output")]
    pub no_mesh: bool,
    /// Virtual views of depth L1 of the mesh, where there is a true one; 0 leaves it out. They take
    /// most of the time of a small run's figures.
    #[arg(long, value_name = "N", default_value_t = 1000, help_heading = "Output")]
    pub mesh_views: usize,
    /// Save the run after every N-th frame, and likewise in the last optimisation, so that
    /// --resume can continue from there; 0 never does.
    #[arg(long, value_name = "N", default_value_t = 100, help_heading = "Interrupted runs")]
    pub checkpoint_every: usize,
    /// Continue an interrupted run, to the same files as if it had not been interrupted: DIR is
    /// its output folder, and all else is as it was started; or give it without DIR at the end of
    /// the same command. With the whole command, a run of which there is nothing yet starts, and
    /// one that has finished is left alone.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath, help_heading = "Interrupted runs")]
    pub resume: Option<Option<PathBuf>>,
    /// What was typed.
    #[arg(skip)]
    pub invocation: Invocation,
}

/// `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Folder, .zip or .sens of the recording.
    #[arg(value_name = "DATASET", value_hint = ValueHint::AnyPath, required_unless_present_any = ["resume", "from"])]
    pub dataset: Option<PathBuf>,
    /// Take the recording and all options from this file, as `evaluate` writes one for each of its
    /// runs, and nothing else from the command line. The results go beside it; an interrupted run
    /// is continued, and a finished one left alone.
    #[arg(long, value_name = "RUN.toml", value_hint = ValueHint::FilePath, help_heading = "Interrupted runs")]
    pub from: Option<PathBuf>,
    /// Which part of the recording, and how it is read.
    #[command(flatten)]
    pub selection: SelectionArgs,
    /// Ground-truth mesh to compare with [default: mesh.ply in the recording's folder, if there].
    #[arg(long, value_name = "GT.ply", value_hint = ValueHint::FilePath, help_heading = "Output")]
    pub mesh: Option<PathBuf>,
    /// Configuration.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Engine.
    #[command(flatten)]
    pub engine: EngineArgs,
    /// Output.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// `demo`.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Number of frames of the built-in sequence.
    #[arg(long, value_name = "N", default_value = "60", value_parser = at_least_one, help_heading = "Recording")]
    pub frames: usize,
    /// Image width in pixels; the height is three quarters of it.
    #[arg(long, value_name = "PIXELS", default_value = "160", value_parser = picture_width, help_heading = "Recording")]
    pub width: u32,
    /// Labels of a network, in place of the true ones, which its classes are scored against.
    #[command(flatten)]
    pub segmentation: SegmenterArgs,
    /// Configuration.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Engine.
    #[command(flatten)]
    pub engine: EngineArgs,
    /// Output.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// `mesh`.
#[derive(Debug, Args)]
pub struct MeshArgs {
    /// Output folder of a run.
    #[arg(value_name = "OUT", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Voxel size in metres.
    #[arg(long, value_name = "M", default_value_t = 0.01, value_parser = positive_metres)]
    pub resolution: f64,
    /// Engine.
    #[command(flatten)]
    pub engine: EngineArgs,
}

/// `render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
    /// Output folder of a run.
    #[arg(value_name = "OUT", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Where to look from.
    #[command(flatten)]
    pub from: ViewArgs,
    /// Engine.
    #[command(flatten)]
    pub engine: EngineArgs,
}

/// Where to look from: one of these. Poses are `world_from_camera` in the world of
/// OUT/trajectory.txt; the camera looks along its z axis, x points right and y down.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct ViewArgs {
    /// Frame whose estimated pose is taken (counted from 0, as the pictures are named).
    #[arg(long, value_name = "I")]
    pub frame: Option<usize>,
    /// A pose: position in metres and quaternion, in quotes.
    #[arg(long, value_name = "tx ty tz qx qy qz qw", value_parser = pose, allow_hyphen_values = true)]
    pub pose: Option<Pose>,
    /// A path of poses, one `t tx ty tz qx qy qz qw` per line (TUM format).
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub path: Option<PathBuf>,
}

/// `synth`.
#[derive(Debug, Args)]
pub struct SynthArgs {
    /// Folder to write to; must be empty or absent.
    #[arg(value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub dir: PathBuf,
    /// Number of frames.
    #[arg(long, value_name = "N", default_value = "200", value_parser = at_least_one)]
    pub frames: usize,
    /// Image width in pixels; the height is three quarters of it.
    #[arg(long, value_name = "PIXELS", default_value = "320", value_parser = picture_width)]
    pub width: u32,
    /// Which scene.
    #[arg(long, value_enum, default_value_t, value_name = "SCENE")]
    pub scene: SceneChoice,
    /// Write N views from other poses to DIR/novel; `run` and `eval` score them apart.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub novel: usize,
}

/// A built-in scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SceneChoice {
    /// A living room of 5 x 4.5 x 2.6 m.
    #[default]
    Room,
    /// An office of 5.4 x 4.4 x 2.7 m.
    Office,
    /// A hall of 10 x 9 x 8 m.
    Hall,
}

/// `serve`.
#[derive(Debug, Args)]
pub struct ServeArgs {
    /// Folder, .zip or .sens of the recording.
    #[arg(value_name = "DATASET", value_hint = ValueHint::AnyPath)]
    pub dataset: PathBuf,
    /// Port to listen at; 0 takes a free one.
    #[arg(long, value_name = "PORT", default_value_t = 8080)]
    pub port: u16,
    /// Address to listen at. Any other than this machine's own lets others read the recording.
    #[arg(long, value_name = "IP", default_value = "127.0.0.1")]
    pub address: std::net::IpAddr,
    /// Folder of the built page [default: www/dist here or above the program].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub page: Option<PathBuf>,
    /// Which part of the recording, and how it is read.
    #[command(flatten)]
    pub selection: SelectionArgs,
}

/// A row of the ablation's table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AblationRow {
    /// Neither module.
    Neither,
    /// Feature fusion alone.
    Mtff,
    /// Redundancy suppressor alone.
    Frs,
    /// Both modules.
    Both,
    /// Both, but the fusion without its local module.
    NoLocal,
    /// Neither, and a perceptron 32-256-256-256-C on every sample instead of a head once per ray:
    /// about a hundred times the work. Only builds with the feature `sample-head` have it.
    SampleHead,
}

impl AblationRow {
    /// All that this build has, as the table shows them.
    pub fn all() -> Vec<AblationRow> {
        let mut rows = vec![
            AblationRow::Neither,
            AblationRow::Mtff,
            AblationRow::Frs,
            AblationRow::Both,
            AblationRow::NoLocal,
        ];
        if mte_slam_core::map::HAS_SAMPLE_HEAD {
            rows.push(AblationRow::SampleHead);
        }
        rows
    }
}

/// `ablate`.
#[derive(Debug, Args)]
pub struct AblateArgs {
    /// Folder, .zip or .sens of the recording.
    #[arg(value_name = "DATASET", value_hint = ValueHint::AnyPath)]
    pub dataset: PathBuf,
    /// Seeds 1 to N for every row.
    #[arg(long, value_name = "N", default_value = "5", value_parser = at_least_one)]
    pub seeds: usize,
    /// Rows of the table, in this order.
    #[arg(
        long,
        value_enum,
        value_name = "ROWS",
        value_delimiter = ',',
        default_values_t = AblationRow::all()
    )]
    pub rows: Vec<AblationRow>,
    /// Output folder: empty, absent, or of an ablation that is to be continued [default:
    /// out/DATASET-PRESET-ablation].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// Render and score every K-th frame.
    #[arg(long, value_name = "K", default_value = "5", value_parser = at_least_one)]
    pub render_every: usize,
    /// Which part of the recording, and how it is read.
    #[command(flatten)]
    pub selection: SelectionArgs,
    /// Configuration of all rows; modules, class head and seed are set by the ablation.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Engine.
    #[command(flatten)]
    pub engine: EngineArgs,
}

/// `info`.
#[derive(Debug, Args)]
pub struct InfoArgs {}

/// `bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// Iterations to average over.
    #[arg(long, value_name = "N", default_value = "10", value_parser = at_least_one)]
    pub iterations: usize,
    /// Leave out the perceptron on every sample: it takes minutes where one processor does the work.
    #[arg(long)]
    pub no_baseline: bool,
    /// Engine.
    #[command(flatten)]
    pub engine: EngineArgs,
}

/// `shaders`.
#[derive(Debug, Args)]
pub struct ShadersArgs {
    /// Folder to write to.
    #[arg(value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub dir: PathBuf,
}

/// `settings`.
#[derive(Debug, Args)]
pub struct SettingsArgs {
    /// List only settings whose path or meaning contains this.
    #[arg(value_name = "WORD", default_value = "", hide_default_value = true)]
    pub word: String,
    /// Preset whose values are listed.
    #[arg(long, value_name = "PRESET", default_value = "replica")]
    pub preset: String,
    /// Print docs/guide/configuration.md.
    #[arg(long, hide = true)]
    pub markdown: bool,
    /// Print the browser package's types of the settings.
    #[arg(long, hide = true)]
    pub typescript: bool,
}
