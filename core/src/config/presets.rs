//! Presets: the defaults with some settings changed.
use super::Config;

impl Config {
    /// Names of the presets, from the quickest on.
    pub const PRESETS: [&'static str; 5] = ["tiny", "fast", "replica", "scannet", "tum"];

    /// A preset by name.
    pub fn preset(name: &str) -> Option<Config> {
        let mut c = Config::default();
        match name {
            "tiny" => {
                fast(&mut c);
                c.mapping.rays = 600;
                c.mapping.iterations = 6;
                c.mapping.first_iterations = 60;
                c.mapping.final_iterations = 20;
                c.mapping.semantic_iterations = 120;
                c.sampling.stratified = 16;
                c.tracking.align_pixels = 1024;
            }
            "fast" => fast(&mut c),
            "replica" => {}
            "scannet" => {
                c.tracking.render_iterations = 30;
                c.tracking.render_rate_translation_m = 5e-4;
                c.tracking.render_rate_rotation_rad = 2.5e-3;
            }
            "tum" => {
                c.tracking.render_iterations = 30;
                c.tracking.render_rate_translation_m = 1e-2;
                c.tracking.render_rate_rotation_rad = 5e-3;
                c.mapping.every = 1;
                c.keyframes.every = 1;
            }
            _ => return None,
        }
        Some(c)
    }
}

fn fast(c: &mut Config) {
    c.mapping.rays = 2000;
    c.mapping.iterations = 10;
    c.mapping.first_iterations = 120;
    c.mapping.final_iterations = 40;
    c.sampling.stratified = 20;
    c.tracking.align_pixels = 2048;
}

/// What a preset is for, in the words of the guide.
pub(super) fn purpose(name: &str) -> &'static str {
    match name {
        "tiny" => "a quick look, and machines without a GPU",
        "fast" => "less work per frame, for a small loss of quality; the demo's and the page's",
        "replica" => "the defaults: best quality",
        "scannet" => "real rooms, filmed by hand",
        "tum" => "fast motion: maps every frame",
        _ => "",
    }
}
