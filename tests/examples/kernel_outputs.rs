//! Writes the CPU engine's results of every kernel's cases and of a short run to a file, for the
//! browser to compare with: `cargo run -p mte-slam-tests --example kernel_outputs -- FILE`.
use mte_slam_tests::recorded::Recorded;

fn main() {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("usage: kernel_outputs FILE");
        std::process::exit(2);
    };
    let partial = format!("{path}.tmp");
    let bytes = Recorded::make().to_bytes();
    let written = std::fs::write(&partial, bytes).and_then(|()| std::fs::rename(&partial, &path));
    if let Err(e) = written {
        eprintln!("{path}: {e}");
        std::process::exit(1);
    }
}
