//! PNG files of what the map renders, and a small canvas to draw comparison sheets on.
use super::font;
use anyhow::{Context, Result};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use mte_slam_types::classes::{ClassTable, UNLABELLED};

/// 8-bit RGB.
pub fn color_png(width: u32, height: u32, color: &[[u8; 3]]) -> Result<Vec<u8>> {
    encode(width, height, color.as_flattened(), ExtendedColorType::Rgb8)
}

/// Depth \[m\] as 16-bit millimetres; 0 where there is none, 65535 for anything farther.
pub fn depth_png(width: u32, height: u32, depth_m: &[f32]) -> Result<Vec<u8>> {
    let bytes: Vec<u8> = depth_m
        .iter()
        .flat_map(|&d| {
            let mm = if d.is_finite() && d > 0.0 { (f64::from(d) * 1000.0).round() } else { 0.0 };
            (mm.min(65535.0) as u16).to_ne_bytes()
        })
        .collect();
    encode(width, height, &bytes, ExtendedColorType::L16)
}

/// Class images hold the data set's raw ids, 16 bits. Where nothing was rendered: the id of
/// [`unlabelled_id`].
pub fn class_png(width: u32, height: u32, class: &[u8], table: &ClassTable) -> Result<Vec<u8>> {
    let none = unlabelled_id(table);
    let bytes: Vec<u8> = class
        .iter()
        .flat_map(|&c| table.classes.get(usize::from(c)).map_or(none, |c| c.raw_id).to_ne_bytes())
        .collect();
    encode(width, height, &bytes, ExtendedColorType::L16)
}

/// Classes in their display colours, black without one.
pub fn class_color_png(
    width: u32,
    height: u32,
    class: &[u8],
    table: &ClassTable,
) -> Result<Vec<u8>> {
    let colors: Vec<[u8; 3]> = class.iter().map(|&c| class_color(c, table)).collect();
    color_png(width, height, &colors)
}

/// The raw id that class images hold where there is no class: 0, or the greatest that is no class.
pub fn unlabelled_id(table: &ClassTable) -> u16 {
    let free = |id: &u16| table.classes.iter().all(|c| c.raw_id != *id);
    std::iter::once(0).chain((1..=u16::MAX).rev()).find(free).unwrap_or(0)
}

/// Display colour of a compact class index; black without one.
pub fn class_color(class: u8, table: &ClassTable) -> [u8; 3] {
    if class == UNLABELLED {
        return [0; 3];
    }
    table.classes.get(usize::from(class)).map_or([255, 0, 255], |c| c.color)
}

fn encode(width: u32, height: u32, bytes: &[u8], kind: ExtendedColorType) -> Result<Vec<u8>> {
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(bytes, width, height, kind)
        .with_context(|| format!("a picture of {width}x{height} pixels cannot be encoded"))?;
    Ok(png)
}

/// An RGB picture to draw on. Whatever falls outside is cut off.
pub struct Canvas {
    /// Width \[pixels\].
    pub width: usize,
    /// Height \[pixels\].
    pub height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// Filled with one colour.
    pub fn new(width: usize, height: usize, fill: [u8; 3]) -> Canvas {
        Canvas { width, height, pixels: vec![fill; width * height] }
    }

    /// Sets one pixel.
    pub fn set(&mut self, x: usize, y: usize, color: [u8; 3]) {
        if x < self.width && y < self.height {
            self.pixels[y * self.width + x] = color;
        }
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, x: usize, y: usize, w: usize, h: usize, color: [u8; 3]) {
        for v in y..(y + h).min(self.height) {
            for u in x..(x + w).min(self.width) {
                self.set(u, v, color);
            }
        }
    }

    /// Puts an image of `w` pixels per row at (x, y), each pixel `zoom` pixels wide and high.
    pub fn image(&mut self, x: usize, y: usize, w: usize, zoom: usize, image: &[[u8; 3]]) {
        for (i, &color) in image.iter().enumerate() {
            self.fill(x + i % w * zoom, y + i / w * zoom, zoom, zoom, color);
        }
    }

    /// Writes text with its top left at (x, y), glyphs `zoom` times 8 pixels.
    pub fn text(&mut self, x: usize, y: usize, zoom: usize, color: [u8; 3], text: &str) {
        for (i, c) in text.chars().enumerate() {
            for (row, bits) in font::glyph(c).iter().enumerate() {
                for column in (0..font::GLYPH).filter(|k| bits >> k & 1 == 1) {
                    let left = x + (i * font::GLYPH + column) * zoom;
                    self.fill(left, y + row * zoom, zoom, zoom, color);
                }
            }
        }
    }

    /// Writes text upwards, its start at the bottom left (x, y); see [`Canvas::text`].
    pub fn text_up(&mut self, x: usize, y: usize, zoom: usize, color: [u8; 3], text: &str) {
        for (i, c) in text.chars().enumerate() {
            for (row, bits) in font::glyph(c).iter().enumerate() {
                for column in (0..font::GLYPH).filter(|k| bits >> k & 1 == 1) {
                    let along = (i * font::GLYPH + column + 1) * zoom;
                    if let Some(top) = y.checked_sub(along) {
                        self.fill(x + row * zoom, top, zoom, zoom, color);
                    }
                }
            }
        }
    }

    /// As PNG.
    pub fn png(&self) -> Result<Vec<u8>> {
        color_png(self.width as u32, self.height as u32, &self.pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mte_slam_types::classes::Class;

    #[test]
    fn depth_and_class_pictures_read_back() {
        let depth = depth_png(2, 2, &[0.0, 1.2344, f32::NAN, 1e9]).unwrap();
        let read = image::load_from_memory(&depth).unwrap();
        assert_eq!(read.color(), image::ColorType::L16);
        assert_eq!(read.into_luma16().into_raw(), [0, 1234, 0, 65535]);
        let class = |raw_id| Class { raw_id, name: String::new(), color: [1, 2, 3] };
        let mut table = ClassTable { classes: vec![class(7), class(300)] };
        let read = |t: &ClassTable| {
            let png = class_png(3, 1, &[1, 0, UNLABELLED], t).unwrap();
            image::load_from_memory(&png).unwrap().into_luma16().into_raw()
        };
        assert_eq!(read(&table), [300, 7, 0]);
        table.classes.push(class(0));
        assert_eq!(read(&table), [300, 7, 65535]);
        table.classes.push(class(65535));
        assert_eq!(read(&table), [300, 7, 65534]);
    }

    #[test]
    fn text_draws_inside_its_cells() {
        let mut canvas = Canvas::new(16, 8, [0; 3]);
        canvas.text(8, 0, 1, [255; 3], "A");
        assert!(canvas.pixels.iter().enumerate().all(|(i, p)| p[0] == 0 || i % 16 >= 8));
        assert!(canvas.pixels.iter().filter(|p| p[0] == 255).count() > 20);
        // Upwards: the same glyph, a quarter turn to the left.
        let mut turned = Canvas::new(8, 16, [0; 3]);
        turned.text_up(0, 16, 1, [255; 3], " A");
        for y in 0..8 {
            for x in 0..8 {
                assert_eq!(canvas.pixels[y * 16 + 8 + x], turned.pixels[(7 - x) * 8 + y]);
            }
        }
    }
}
