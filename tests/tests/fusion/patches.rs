//! Where a patch of the image shows up among the tokens.
use crate::{SLOT, device};
use mte_slam_core::{
    commands::Commands, config::FusionConfig, engine::Engine, kernels::tokens::APPEARANCE_AT,
};
use mte_slam_tests::{fixture, gpu_engine, rig::Rig};
use mte_slam_types::frame::Frame;

/// The response of the appearance embedding at every token, in raster order.
fn appearance(d: &mut Rig, frame: &Frame) -> Vec<Vec<u32>> {
    let mut r = Commands::new();
    d.upload_frame(&mut r, SLOT, frame);
    d.record_fusion_forward(&mut r, SLOT);
    d.submit(&r);
    let (tokens, stride, count) = d.tokens();
    let rows = d.read_words(tokens, count * stride);
    let at = APPEARANCE_AT as usize;
    rows.chunks_exact(stride).map(|row| row[at..at + 16].to_vec()).collect()
}

/// A bright square (left, top, edge) on a dark image.
fn bright(left: u32, top: u32, edge: u32) -> Frame {
    let camera = fixture::wide_camera();
    let mut frame = fixture::frame_of(&camera, 0);
    for (i, c) in frame.color.iter_mut().enumerate() {
        let (u, v) = (i as u32 % camera.width, i as u32 / camera.width);
        let inside = (left..left + edge).contains(&u) && (top..top + edge).contains(&v);
        *c = if inside { [250, 180, 90] } else { [0, 0, 0] };
    }
    frame
}

/// A patch, and a single pixel, moved by a token move the response by exactly one token: tokens
/// lie in raster order, on a grid of more columns than rows.
fn deltas(engine: Engine) {
    let mut d = device(engine, FusionConfig::default());
    let dark = appearance(&mut d, &bright(0, 0, 0));
    assert!(dark.iter().all(|token| *token == dark[0]));
    let (columns, rows) = (13, 7);
    for (left, top, edge) in [(0, 0, 8), (3, 5, 1)] {
        let mut first = Vec::new();
        for (column, row) in
            (0..columns).map(|c| (c, 2)).chain((0..rows).map(|r| (4, r))).chain([(12, 6)])
        {
            let frame = bright(8 * column + left, 8 * row + top, edge);
            let response = appearance(&mut d, &frame);
            let lit: Vec<usize> = (0..response.len()).filter(|i| response[*i] != dark[0]).collect();
            let token = (row * columns + column) as usize;
            assert_eq!(lit, [token], "column {column}, row {row}");
            if first.is_empty() {
                first = response[token].clone();
            }
            assert_eq!(response[token], first, "column {column}, row {row}");
        }
        // Within a token the place of the pixel matters.
        if edge == 1 {
            let transposed = appearance(&mut d, &bright(8 * 4 + top, 8 * 2 + left, edge));
            assert_ne!(transposed[2 * 13 + 4], first);
        }
    }
    // Beyond the last whole token nothing is seen.
    assert_eq!(appearance(&mut d, &bright(105, 57, 2)), dark);
}

#[test]
fn a_patch_moves_its_own_token() {
    deltas(Engine::cpu());
    gpu_engine().into_iter().for_each(deltas);
}
