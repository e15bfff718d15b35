//! Browser bindings of MTE-SLAM: what the page calls, thin over the core.
use mte_slam_core::camera::Camera;
use wasm_bindgen::prelude::*;

/// Version of this package.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}

/// A line for people about a pinhole camera: image size \[pixels\] and field of view \[degrees\].
/// `width`, `height`, `fx`, `fy`, `cx`, `cy` are in pixels.
///
/// # Errors
/// When the image is empty or a focal length is not positive and finite.
#[wasm_bindgen]
pub fn describe_camera(
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
) -> Result<String, JsError> {
    describe(&Camera { width, height, fx, fy, cx, cy }).map_err(|e| JsError::new(&e))
}

/// `describe_camera` without the browser's error type, which exists in a browser only.
fn describe(camera: &Camera) -> Result<String, String> {
    let Camera { width, height, fx, fy, cx, cy } = *camera;
    if width == 0 || height == 0 {
        return Err(format!("image is {width} x {height} pixels, expected at least 1 x 1"));
    }
    if !(fx.is_finite() && fy.is_finite() && fx > 0.0 && fy > 0.0) {
        return Err(format!("focal lengths are {fx}, {fy} pixels, expected positive numbers"));
    }
    if !(cx.is_finite() && cy.is_finite()) {
        return Err(format!("principal point is at {cx}, {cy} pixels, expected finite numbers"));
    }
    // A pixel covers half a pixel to either side of its centre, so the image ends half a pixel
    // beyond the centres of its outermost pixels.
    let (right, bottom) = (f64::from(width) - 0.5, f64::from(height) - 0.5);
    let corner = |u, v| camera.back_project(u, v, 1.0);
    let (low, high) = (corner(-0.5, -0.5), corner(right, bottom));
    let horizontal = (high.x.atan() - low.x.atan()).to_degrees();
    let vertical = (high.y.atan() - low.y.atan()).to_degrees();
    Ok(format!("{width} x {height} pixels, field of view {horizontal:.1} x {vertical:.1} degrees"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Camera {
        Camera { width: 200, height: 200, fx: 100.0, fy: 100.0, cx: 99.5, cy: 99.5 }
    }

    #[test]
    fn focal_length_of_half_the_width_sees_ninety_degrees() {
        assert_eq!(
            describe(&square()).unwrap(),
            "200 x 200 pixels, field of view 90.0 x 90.0 degrees"
        );
    }

    #[test]
    fn impossible_cameras_are_refused_with_the_value_found() {
        let empty = Camera { height: 0, ..square() };
        assert!(describe(&empty).unwrap_err().contains("200 x 0"));
        for fx in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let camera = Camera { fx, ..square() };
            assert!(describe(&camera).unwrap_err().contains(&fx.to_string()));
        }
        let nowhere = Camera { cy: f64::NAN, ..square() };
        assert!(describe(&nowhere).unwrap_err().contains("NaN"));
    }
}
