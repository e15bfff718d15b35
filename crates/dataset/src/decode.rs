//! Images from bytes. Sizes are checked before anything of that size is allocated.
use super::folder::invalid;
use image::{DynamicImage, ImageDecoder, ImageReader, Limits};
use mte_slam_types::sequence::SequenceError;
use png::{BitDepth, ColorType, Transformations};
use std::io::Cursor;

/// Widest and highest image that is read \[pixels\].
pub const MAX_SIDE: u32 = 16384;
/// Most pixels of an image that is read: 8192 x 8192, so that no file makes us take gigabytes.
pub const MAX_PIXELS: u64 = 1 << 26;
/// Most bytes a decoder may allocate.
const MAX_BYTES: usize = 768 << 20;

/// Width and height \[pixels\].
pub(super) type Size = (u32, u32);

/// The file and frame an image belongs to, for messages.
#[derive(Clone, Copy)]
pub(super) struct Origin<'a> {
    pub file: &'a str,
    pub frame: u64,
    /// For example `depth image`.
    pub what: &'static str,
}

impl Origin<'_> {
    pub(super) fn error(
        &self,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> SequenceError {
        invalid(self.file, Some(self.frame), self.what, found, expected)
    }

    pub(super) fn check_size(
        &self,
        size: Size,
        expected: Option<Size>,
    ) -> Result<(), SequenceError> {
        let (w, h) = size;
        let field = format!("{} size", self.what);
        let found = format!("{w}x{h}");
        let pixels = u64::from(w) * u64::from(h);
        if pixels == 0 || w > MAX_SIDE || h > MAX_SIDE || pixels > MAX_PIXELS {
            let limits = format!("1x1 to {MAX_SIDE}x{MAX_SIDE}, and at most {MAX_PIXELS} pixels");
            return Err(invalid(self.file, Some(self.frame), field, found, limits));
        }
        match expected {
            Some(e) if e != size => {
                Err(invalid(self.file, Some(self.frame), field, found, format!("{}x{}", e.0, e.1)))
            }
            _ => Ok(()),
        }
    }
}

/// Colour from a PNG or JPEG of any bit depth, row-major; alpha is dropped.
pub(super) fn color(
    bytes: &[u8],
    origin: Origin<'_>,
    expected: Option<Size>,
) -> Result<Vec<[u8; 3]>, SequenceError> {
    let readable = "a complete PNG or JPEG image";
    let failed = |e: image::ImageError| origin.error(e.to_string(), readable);
    let reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| origin.error(e.to_string(), readable))?;
    let is_jpeg = match reader.format() {
        Some(image::ImageFormat::Jpeg) => true,
        Some(image::ImageFormat::Png) => false,
        _ => return Err(origin.error(describe(bytes), readable)),
    };
    // The JPEG decoder fills what is missing with grey, so look for the end ourselves.
    if is_jpeg && !jpeg_has_end(bytes) {
        let found = format!("a JPEG cut off after {} bytes", bytes.len());
        return Err(origin.error(found, readable));
    }
    let mut decoder = reader.into_decoder().map_err(failed)?;
    let size = decoder.dimensions();
    origin.check_size(size, expected)?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES as u64);
    decoder.set_limits(limits).map_err(failed)?;
    let rgb = DynamicImage::from_decoder(decoder).map_err(failed)?.into_rgb8();
    if rgb.dimensions() != size {
        return Err(origin.error(format!("{:?} pixels", rgb.dimensions()), format!("{size:?}")));
    }
    Ok(rgb.pixels().map(|p| p.0).collect())
}

/// Decodes depth: the exact numbers of a 16-bit grey PNG.
pub(super) fn depth(
    bytes: &[u8],
    origin: Origin<'_>,
    expected: Option<Size>,
) -> Result<Vec<u16>, SequenceError> {
    let wanted = "a 16-bit grey PNG";
    let raw = RawPng::read(bytes, origin, expected, wanted, |color, bits| {
        color == ColorType::Grayscale && bits == BitDepth::Sixteen
    })?;
    Ok(raw.words())
}

/// Decodes labels: the numbers of a grey or palette PNG of up to 16 bits. Palette entries are read as
/// indices; their colours mean nothing here.
pub(super) fn labels(bytes: &[u8], origin: Origin<'_>) -> Result<(Vec<u16>, Size), SequenceError> {
    let wanted = "a grey or palette PNG that holds class ids";
    let raw = RawPng::read(bytes, origin, None, wanted, |color, _| {
        matches!(color, ColorType::Grayscale | ColorType::Indexed)
    })?;
    let ids = match raw.bits {
        16 => raw.words(),
        8 => raw.data.iter().map(|&b| u16::from(b)).collect(),
        bits => raw.packed(bits),
    };
    Ok((ids, raw.size))
}

/// Returns the size of a PNG or JPEG, from its header.
pub(super) fn size_of(bytes: &[u8], origin: Origin<'_>) -> Result<Size, SequenceError> {
    let readable = "a PNG or JPEG image";
    let reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| origin.error(e.to_string(), readable))?;
    if reader.format().is_none() {
        return Err(origin.error(describe(bytes), readable));
    }
    let size = reader.into_dimensions().map_err(|e| origin.error(e.to_string(), readable))?;
    origin.check_size(size, None)?;
    Ok(size)
}

/// Samples of a PNG as they are stored.
struct RawPng {
    size: Size,
    bits: u8,
    data: Vec<u8>,
}

impl RawPng {
    fn read(
        bytes: &[u8],
        origin: Origin<'_>,
        expected: Option<Size>,
        wanted: &str,
        accepts: impl Fn(ColorType, BitDepth) -> bool,
    ) -> Result<Self, SequenceError> {
        if !bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
            return Err(origin.error(describe(bytes), wanted));
        }
        let broken = |e: png::DecodingError| {
            origin.error(format!("a broken PNG of {} bytes ({e})", bytes.len()), wanted)
        };
        let limits = png::Limits { bytes: MAX_BYTES };
        let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
        decoder.set_transformations(Transformations::IDENTITY);
        let header = decoder.read_header_info().map_err(broken)?;
        let size = (header.width, header.height);
        let (color, depth) = (header.color_type, header.bit_depth);
        if !accepts(color, depth) {
            return Err(origin.error(kind(color, depth), wanted));
        }
        origin.check_size(size, expected)?;
        let mut reader = decoder.read_info().map_err(broken)?;
        let length = reader.output_buffer_size().filter(|&n| n <= MAX_BYTES).ok_or_else(|| {
            origin.error(format!("{}x{} pixels", size.0, size.1), "an image that fits in memory")
        })?;
        let mut data = vec![0; length];
        let info = reader.next_frame(&mut data).map_err(broken)?;
        if (info.width, info.height) != size {
            let found = format!("a first frame of {}x{}", info.width, info.height);
            return Err(origin.error(found, wanted));
        }
        Ok(Self { size, bits: depth as u8, data })
    }

    /// 16-bit samples; PNG stores the high byte first.
    fn words(&self) -> Vec<u16> {
        self.data.as_chunks::<2>().0.iter().map(|b| u16::from_be_bytes(*b)).collect()
    }

    /// Samples of 1, 2 or 4 bits; each row starts at a byte, the first sample in the high bits.
    fn packed(&self, bits: u8) -> Vec<u16> {
        let (w, bits) = (self.size.0 as usize, usize::from(bits));
        let row_bytes = (w * bits).div_ceil(8);
        let mask = (1u8 << bits) - 1;
        self.data
            .chunks_exact(row_bytes)
            .flat_map(|row| {
                (0..w).map(move |x| {
                    let shift = 8 - bits - (x * bits) % 8;
                    u16::from((row[x * bits / 8] >> shift) & mask)
                })
            })
            .collect()
    }
}

fn kind(color: ColorType, depth: BitDepth) -> String {
    let name = match color {
        ColorType::Grayscale => "grey",
        ColorType::Rgb => "RGB",
        ColorType::Indexed => "palette",
        ColorType::GrayscaleAlpha => "grey + alpha",
        ColorType::Rgba => "RGBA",
    };
    format!("a {}-bit {name} PNG", depth as u8)
}

/// What bytes that are no image look like.
fn describe(bytes: &[u8]) -> String {
    match bytes {
        [] => "an empty file".into(),
        [0xff, 0xd8, ..] => "a JPEG".into(),
        _ => format!(
            "{} bytes starting with {:02x?}, which is no image format known here",
            bytes.len(),
            &bytes[..bytes.len().min(4)]
        ),
    }
}

/// Returns whether an end-of-image marker follows the first start of scan. (Within a scan, FF is always
/// followed by 00 or a restart marker.)
fn jpeg_has_end(bytes: &[u8]) -> bool {
    let mut at = 2;
    while let Some(&[ff, marker, high, low]) = bytes.get(at..at + 4) {
        if ff != 0xff {
            return true; // not a segment: leave the verdict to the decoder
        }
        if marker == 0xff {
            at += 1; // fill byte
            continue;
        }
        if marker == 0xda {
            return bytes[at..].windows(2).any(|w| w == [0xff, 0xd9]);
        }
        at += 2 + usize::from(u16::from_be_bytes([high, low]));
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORIGIN: Origin<'_> = Origin { file: "x.png", frame: 3, what: "depth image" };

    fn png_of(color: ColorType, bits: BitDepth, w: u32, h: u32, data: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, w, h);
        encoder.set_color(color);
        encoder.set_depth(bits);
        if color == ColorType::Indexed {
            encoder.set_palette(vec![7; 3 * 256]);
        }
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        out
    }

    #[test]
    fn depth_is_exact_and_other_kinds_are_refused_by_name() {
        let png = png_of(ColorType::Grayscale, BitDepth::Sixteen, 2, 1, &[0x12, 0x34, 0xff, 0xff]);
        assert_eq!(depth(&png, ORIGIN, Some((2, 1))).unwrap(), [0x1234, 0xffff]);
        let e = depth(&png, ORIGIN, Some((4, 1))).unwrap_err().to_string();
        assert!(e.contains("x.png (frame 3)") && e.contains("2x1") && e.contains("4x1"), "{e}");
        for (color, bits, n, name) in [
            (ColorType::Grayscale, BitDepth::Eight, 2, "8-bit grey"),
            (ColorType::Rgb, BitDepth::Eight, 6, "8-bit RGB"),
            (ColorType::Rgb, BitDepth::Sixteen, 12, "16-bit RGB"),
        ] {
            let png = png_of(color, bits, 2, 1, &vec![0; n]);
            let e = depth(&png, ORIGIN, None).unwrap_err().to_string();
            assert!(e.contains(name) && e.contains("16-bit grey PNG"), "{e}");
        }
    }

    #[test]
    fn labels_are_indices_of_every_bit_depth() {
        for (color, bits, data, want) in [
            (ColorType::Indexed, BitDepth::Eight, &[3u8, 200, 0][..], [3, 200, 0]),
            (ColorType::Indexed, BitDepth::Four, &[0x3a, 0xf0], [3, 10, 15]),
            (ColorType::Indexed, BitDepth::Two, &[0b11_01_10_00], [3, 1, 2]),
            (ColorType::Grayscale, BitDepth::One, &[0b101_00000], [1, 0, 1]),
            (ColorType::Grayscale, BitDepth::Sixteen, &[1, 0, 0, 5, 255, 255], [256, 5, 65535]),
        ] {
            let png = png_of(color, bits, 3, 1, data);
            assert_eq!(labels(&png, ORIGIN).unwrap().0, want, "{color:?} {bits:?}");
        }
        let rgb = png_of(ColorType::Rgb, BitDepth::Eight, 1, 1, &[0; 3]);
        assert!(labels(&rgb, ORIGIN).unwrap_err().to_string().contains("8-bit RGB"));
    }

    #[test]
    fn broken_images_are_errors() {
        let png = png_of(ColorType::Grayscale, BitDepth::Sixteen, 9, 9, &[77; 162]);
        for n in 0..png.len() - 12 {
            assert!(depth(&png[..n], ORIGIN, None).is_err(), "{n} bytes");
            assert!(color(&png[..n], ORIGIN, None).is_err(), "{n} bytes");
        }
        assert!(depth(b"P5 2 2 255 ", ORIGIN, None).is_err());
        assert!(size_of(b"GIF89a", ORIGIN).is_err() && size_of(b"", ORIGIN).is_err());
    }

    #[test]
    fn a_cut_jpeg_is_an_error() {
        let mut jpeg = Vec::new();
        let pixels: Vec<u8> = (0..64 * 64 * 3).map(|i: u32| (i * i / 7) as u8).collect();
        image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 95)
            .encode(&pixels, 64, 64, image::ExtendedColorType::Rgb8)
            .unwrap();
        assert_eq!(color(&jpeg, ORIGIN, Some((64, 64))).unwrap().len(), 4096);
        for part in [1, 2, 3] {
            let e = color(&jpeg[..jpeg.len() * part / 4], ORIGIN, None).unwrap_err();
            assert!(e.to_string().contains("x.png (frame 3)"), "{e}");
        }
    }

    #[test]
    fn huge_sizes_are_refused_before_allocation() {
        let mut png = png_of(ColorType::Grayscale, BitDepth::Sixteen, 1, 1, &[0, 0]);
        png[16..20].copy_from_slice(&60_000u32.to_be_bytes());
        png[20..24].copy_from_slice(&60_000u32.to_be_bytes());
        let crc = crc32(&png[12..29]);
        png[29..33].copy_from_slice(&crc.to_be_bytes());
        for e in [depth(&png, ORIGIN, None).unwrap_err(), color(&png, ORIGIN, None).unwrap_err()] {
            assert!(e.to_string().contains("60000x60000"), "{e}");
        }
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0, |crc, &b| {
            (0..8).fold(crc ^ u32::from(b), |c, _| (c >> 1) ^ (0xedb8_8320 * (c & 1)))
        })
    }
}
