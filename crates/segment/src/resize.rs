//! Bringing images to the network's size, as the networks were trained: Pillow's resampling.

/// Filters that Pillow numbers 0, 2 and 3; others are taken for bilinear.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Filter {
    Nearest,
    #[default]
    Bilinear,
    Bicubic,
}

/// Binary places of the weights, as Pillow has them for 8-bit images.
const PLACES: u32 = 22;

/// Weights of the inputs of one output.
struct Taps {
    first: usize,
    weights: Vec<i32>,
}

fn kernel(filter: Filter, x: f64) -> f64 {
    let x = x.abs();
    match filter {
        Filter::Nearest => 0.0,
        Filter::Bilinear => (1.0 - x).max(0.0),
        // Keys' cubic with a = -0.5, as Pillow's.
        Filter::Bicubic if x < 1.0 => (1.5 * x - 2.5) * x * x + 1.0,
        Filter::Bicubic if x < 2.0 => ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0,
        Filter::Bicubic => 0.0,
    }
}

/// Pillow's coefficients: the filter is widened where the image shrinks.
fn taps(from: usize, to: usize, filter: Filter) -> Vec<Taps> {
    let scale = from as f64 / to as f64;
    if filter == Filter::Nearest {
        let at = |i: usize| (((i as f64 + 0.5) * scale) as usize).min(from - 1);
        return (0..to).map(|i| Taps { first: at(i), weights: vec![1 << PLACES] }).collect();
    }
    let wide = scale.max(1.0);
    let radius = if filter == Filter::Bicubic { 2.0 } else { 1.0 };
    let support = radius * wide;
    (0..to)
        .map(|i| {
            let center = (i as f64 + 0.5) * scale;
            let first = ((center - support + 0.5).max(0.0) as usize).min(from - 1);
            let last = ((center + support + 0.5) as usize).clamp(first + 1, from);
            let raw: Vec<f64> =
                (first..last).map(|k| kernel(filter, (k as f64 - center + 0.5) / wide)).collect();
            let sum: f64 = raw.iter().sum();
            let fixed = |w: &f64| (w / sum * f64::from(1 << PLACES)).round() as i32;
            let weights = raw.iter().map(fixed).collect();
            Taps { first, weights }
        })
        .collect()
}

/// Resamples an image from `from` to `to` (width, height): along rows, rounded to 8 bits as Pillow
/// does, then along columns.
pub(crate) fn resized(
    image: &[[u8; 3]],
    from: [usize; 2],
    to: [usize; 2],
    filter: Filter,
) -> Vec<[u8; 3]> {
    if from == to {
        return image.to_vec();
    }
    let weighted = |taps: &Taps, at: &dyn Fn(usize) -> [u8; 3]| {
        let mut sum = [1i32 << (PLACES - 1); 3];
        for (k, w) in taps.weights.iter().enumerate() {
            let pixel = at(taps.first + k);
            for (s, x) in sum.iter_mut().zip(pixel) {
                *s += w * i32::from(x);
            }
        }
        sum.map(|s| (s >> PLACES).clamp(0, 255) as u8)
    };
    let columns = taps(from[0], to[0], filter);
    let mut narrow = Vec::with_capacity(to[0] * from[1]);
    for row in image.chunks_exact(from[0]) {
        narrow.extend(columns.iter().map(|t| weighted(t, &|x| row[x])));
    }
    let mut out = Vec::with_capacity(to[0] * to[1]);
    for t in taps(from[1], to[1], filter) {
        out.extend((0..to[0]).map(|x| weighted(&t, &|y| narrow[y * to[0] + x])));
    }
    out
}

/// Quarter turns that bring a recording upright.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Turn {
    /// It is upright.
    #[default]
    None,
    /// A quarter turn clockwise.
    Right,
    /// Half a turn.
    Half,
    /// A quarter turn counterclockwise.
    Left,
}

impl Turn {
    /// The turn that undoes this one.
    pub fn inverse(self) -> Turn {
        match self {
            Turn::Right => Turn::Left,
            Turn::Left => Turn::Right,
            same => same,
        }
    }

    /// Width and height after the turn.
    pub(crate) fn size(self, [w, h]: [usize; 2]) -> [usize; 2] {
        match self {
            Turn::None | Turn::Half => [w, h],
            Turn::Right | Turn::Left => [h, w],
        }
    }

    /// Turns an image of `size` (width, height).
    pub(crate) fn turned<T: Copy>(self, image: &[T], size: [usize; 2]) -> Vec<T> {
        let [w, h] = size;
        let [tw, th] = self.size(size);
        let mut out = Vec::with_capacity(w * h);
        for y in 0..th {
            for x in 0..tw {
                let (sx, sy) = match self {
                    Turn::None => (x, y),
                    Turn::Right => (y, h - 1 - x),
                    Turn::Half => (w - 1 - x, h - 1 - y),
                    Turn::Left => (w - 1 - y, x),
                };
                out.push(image[sy * w + sx]);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_undone() {
        let image: Vec<u8> = (0..12).collect();
        let size = [4, 3];
        assert_eq!(Turn::Right.turned(&image, size)[..3], [8, 4, 0]);
        assert_eq!(Turn::Left.turned(&image, size)[..3], [3, 7, 11]);
        for turn in [Turn::None, Turn::Right, Turn::Half, Turn::Left] {
            let turned = turn.turned(&image, size);
            assert_eq!(turn.inverse().turned(&turned, turn.size(size)), image, "{turn:?}");
        }
    }

    /// Values of Pillow 13: `Image.resize` of the same pixels.
    #[test]
    fn images_shrink_and_grow_as_pillows_do() {
        let ramp: Vec<[u8; 3]> = [0u8, 50, 100, 200].map(|x| [x, 255 - x, 7]).to_vec();
        let red = |out: Vec<[u8; 3]>| out.iter().map(|p| p[0]).collect::<Vec<u8>>();
        assert_eq!(red(resized(&ramp, [4, 1], [2, 1], Filter::Bilinear)), [36, 136]);
        assert_eq!(
            red(resized(&ramp, [4, 1], [8, 1], Filter::Bilinear)),
            [0, 13, 38, 63, 88, 125, 175, 200]
        );
        assert_eq!(
            red(resized(&ramp, [4, 1], [4, 2], Filter::Bicubic)),
            [0, 50, 100, 200].repeat(2)
        );
        assert_eq!(red(resized(&ramp, [4, 1], [3, 1], Filter::Bicubic)), [9, 73, 178]);
        assert_eq!(red(resized(&ramp, [4, 1], [2, 1], Filter::Nearest)), [50, 200]);
    }
}
