//! What trains the fusion: classes and color read from F. F is also the rays' target.
use super::{
    gate_tokens::sigmoid,
    shared::{class_logit, head_row},
    tokens::{
        COLOR_AT, FUSED_AT, LOGITS_AT, RAW_HISTOGRAM, RAW_MEAN, RAW_POINT, TokenParams, sixteen,
    },
};
use crate::kernel::{CpuDispatch, load_f32, store_f32};
use crate::layout::TARGET_FLOATS;

kernel! { pub static TOKEN_LOSS = mte_slam_shaders::kernels::token_loss, twin }

fn twin(dispatch: &CpuDispatch<'_>) {
    let p: TokenParams = dispatch.params();
    let Views {
        parameters: w,
        decoders,
        class_weights,
        raw,
        tokens,
        token_gradient: gradient,
        targets,
    } = dispatch.views();
    let inv = 1.0 / p.tokens() as f32;
    dispatch.for_each_invocation(|token| {
        if token >= p.tokens() {
            return;
        }
        let row = token * p.stride as usize;
        let raw = &raw[token * p.raw_stride as usize..(token + 1) * p.raw_stride as usize];
        let histogram = &raw[RAW_HISTOGRAM as usize..];
        let feature = sixteen(tokens, row + FUSED_AT as usize);
        let valid = raw[RAW_POINT as usize + 3];
        let out = &targets[(p.slot as usize * p.tokens() + token) * TARGET_FLOATS..];
        for (c, f) in feature.iter().enumerate() {
            store_f32(&out[c], *f);
        }
        // A patch across a boundary has no feature that fits all its pixels.
        let share = histogram[..p.classes as usize].iter().fold(0.0_f32, |a, b| a.max(*b));
        let logit = |c| class_logit(decoders, &feature, p.classes, c);
        let best = (0..p.classes).map(logit).fold(-1e30_f32, f32::max);
        store_f32(&out[16], valid * (2.0 * share - 1.0).max(0.0));
        store_f32(&out[17], best);
        (18..20).for_each(|k| store_f32(&out[k], 0.0));
        if p.train == 0 {
            return;
        }

        let (mut sum, mut mass, mut mean) = (0.0_f32, 0.0, 0.0);
        for c in 0..p.classes {
            let l = logit(c);
            sum += libm::expf(l - best);
            let t = histogram[c as usize] * class_weights[c as usize];
            mass += t;
            mean += t * l;
        }
        let mut loss = p.weight_class * (mass * (best + libm::logf(sum)) - mean);
        let mut g = [0.0_f32; 16];
        for c in 0..p.classes {
            let t = histogram[c as usize] * class_weights[c as usize];
            let d = p.weight_class * inv * (mass * libm::expf(logit(c) - best) / sum - t);
            store_f32(&gradient[row + (LOGITS_AT + c) as usize], d);
            let head = head_row(decoders, c);
            (0..16).for_each(|k| g[k] += d * head[k]);
        }
        let head = &w[p.color_head as usize..p.color_head as usize + 68];
        for k in 0..3 {
            let z = head[64 + k] + (0..16).map(|c| head[c * 4 + k] * feature[c]).sum::<f32>();
            let y = sigmoid(z);
            let e = y - raw[RAW_MEAN as usize + k];
            loss += p.weight_color * e.abs() / 3.0;
            let sign = if e > 0.0 {
                1.0
            } else if e < 0.0 {
                -1.0
            } else {
                0.0
            };
            let d = p.weight_color * inv / 3.0 * sign * y * (1.0 - y);
            store_f32(&tokens[row + COLOR_AT as usize + k], y);
            store_f32(&gradient[row + COLOR_AT as usize + k], d);
            (0..16).for_each(|c| g[c] += d * head[c * 4 + k]);
        }
        store_f32(&tokens[row + COLOR_AT as usize + 3], loss);
        for (c, d) in g.iter().enumerate() {
            let cell = &gradient[row + FUSED_AT as usize + c];
            store_f32(cell, load_f32(cell) + d);
        }
    });
}
