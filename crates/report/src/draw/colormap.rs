//! Colours for numbers and classes.

/// Google's Turbo map for `t` in [0, 1] (Mikhailov's polynomial fit), sRGB.
pub fn turbo(t: f64) -> [u8; 3] {
    const R: [f64; 6] =
        [0.13572138, 4.61539260, -42.66032258, 132.13108234, -152.94239396, 59.28637943];
    const G: [f64; 6] = [0.09140261, 2.19418839, 4.84296658, -14.18503333, 4.27729857, 2.82956604];
    const B: [f64; 6] =
        [0.10667330, 12.64194608, -60.58204836, 110.36276771, -89.90310912, 27.34824973];
    let t = if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 };
    [R, G, B].map(|c| {
        let v = c.iter().rev().fold(0.0, |sum, k| sum * t + k);
        (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_blue_and_red_and_the_middle_is_green() {
        let [low, mid, high] = [turbo(0.1), turbo(0.5), turbo(1.0)];
        assert!(low[2] > low[0] && low[2] > low[1]);
        assert!(mid[1] > mid[0] && mid[1] > mid[2]);
        assert!(high[0] > high[1] && high[0] > high[2]);
        assert_eq!(turbo(f64::NAN), turbo(0.0));
    }
}
