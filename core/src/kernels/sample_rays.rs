//! Pixel and ray sampling.
use super::shared::{FLAG_DENSE, FLAG_GUIDED, RAY_MASKED, RAY_WORDS, Ray, random_f32, random_u32};
use crate::kernel::{CpuDispatch, store_u32};
use crate::layout::FieldParams;
use mte_slam_shaders::random::salt;

kernel! { pub static SAMPLE_RAYS = mte_slam_shaders::kernels::sample_rays, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: FieldParams = dispatch.params();
    let Views { poses, window, color_images, depth_images, class_rarity, rays: out } =
        dispatch.views();
    let pixels = p.width * p.height;
    let depth_stride = pixels.div_ceil(2);
    let raw_depth = |slot: u32, pixel: u32| {
        (depth_images[(slot * depth_stride + pixel / 2) as usize] >> (16 * (pixel & 1))) & 0xffff
    };
    // Rarity of a pixel's class: 0 without a class, -1 without depth.
    let rarity = |slot: u32, pixel: u32| {
        if raw_depth(slot, pixel) == 0 {
            return -1.0;
        }
        let label = color_images[(slot * pixels + pixel) as usize] >> 24;
        if label >= p.classes { 0.0 } else { class_rarity[label as usize] }
    };
    dispatch.for_each_invocation(|id| {
        let index = id as u32;
        if index >= p.rays {
            return;
        }
        let frame = index / p.rays_per_frame;
        let slot = window[frame as usize] & 0x7fff_ffff;
        let mut pixel = (p.first.wrapping_add(index)) % pixels;
        let mut raw = 0;
        if p.flags & FLAG_DENSE == 0 {
            pixel = random_u32(p.seed, p.iteration, index, salt::PIXEL) % pixels;
            raw = raw_depth(slot, pixel);
            if raw == 0 {
                pixel = random_u32(p.seed, p.iteration, index, salt::PIXEL_AGAIN) % pixels;
                raw = raw_depth(slot, pixel);
            }
            if p.classes > 0 && random_f32(p.seed, p.iteration, index, salt::RARE) < p.rare_share {
                let mut best = rarity(slot, pixel);
                for k in 1..p.rare_draws {
                    let at = index.wrapping_mul(256).wrapping_add(k);
                    let candidate =
                        random_u32(p.seed, p.iteration, at, salt::RARE_CANDIDATE) % pixels;
                    let rare = rarity(slot, candidate);
                    if rare > best {
                        (best, pixel) = (rare, candidate);
                    }
                }
                raw = raw_depth(slot, pixel);
            }
        } else if p.flags & FLAG_GUIDED != 0 {
            raw = raw_depth(slot, pixel);
        }
        let d = [
            ((pixel % p.width) as f32 - p.cx) / p.fx,
            ((pixel / p.width) as f32 - p.cy) / p.fy,
            1.0,
        ];
        let m = &poses[slot as usize * 12..slot as usize * 12 + 12];
        let row = |i: usize| m[i] * d[0] + m[i + 1] * d[1] + m[i + 2] * d[2];
        let c = if p.flags & (FLAG_DENSE | FLAG_GUIDED) == FLAG_DENSE {
            0xff00_0000
        } else {
            color_images[(slot * pixels + pixel) as usize]
        };
        let mut ray = Ray {
            origin: [m[9], m[10], m[11]],
            depth: raw as f32 * p.depth_unit,
            direction: [row(0), row(3), row(6)],
            frame: frame | slot << 8,
            color: [0, 8, 16].map(|shift| ((c >> shift) & 255) as f32 / 255.0),
            label: (c >> 24) | pixel << 8,
        };
        let hit = ray.at(ray.depth);
        let outside = (0..3).any(|k| hit[k] < p.box_min[k] || hit[k] > p.box_max[k]);
        if outside && p.flags & FLAG_DENSE == 0 {
            ray.frame |= RAY_MASKED;
            ray.depth = 0.0;
            ray.label |= 255;
        }
        for (k, word) in ray.words().into_iter().enumerate() {
            store_u32(&out[id * RAY_WORDS + k], word);
        }
    });
}
