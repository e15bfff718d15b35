//! Errors of rendered images: colour (PSNR) and depth (L1 of views).
use super::MetricsError;
use alloc::string::String;
#[cfg(not(feature = "std"))]
use num_traits::Float as _;
use serde::Serialize;

/// What identical images count as \[dB\], so that means stay finite.
pub const MAX_PSNR_DB: f64 = 100.0;

/// Peak signal-to-noise ratio of rendered colour.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PsnrReport {
    /// Id of the protocol, to compare by ([`crate::protocol`]).
    pub protocol_id: String,
    /// What the figures mean.
    pub protocol: String,
    /// Number of images.
    pub images: usize,
    /// Mean over the images of each one's PSNR \[dB\]: the figure that papers print.
    pub mean_of_psnr_db: f64,
    /// PSNR of the mean squared error over all images \[dB\]; never larger.
    pub psnr_of_mean_mse_db: f64,
    /// PSNR of the worst image \[dB\].
    pub min_db: f64,
}

/// Collects images for a [`PsnrReport`].
#[derive(Clone, Debug, Default)]
pub struct PsnrMeter {
    images: usize,
    sum_db: f64,
    sum_mse: f64,
    min_db: f64,
}

fn psnr_db(mse: f64) -> f64 {
    if mse > 0.0 { (10.0 * (255.0 * 255.0 / mse).log10()).min(MAX_PSNR_DB) } else { MAX_PSNR_DB }
}

fn same_size(what: &'static str, found: usize, expected: usize) -> Result<(), MetricsError> {
    if found == expected && expected > 0 {
        return Ok(());
    }
    Err(MetricsError::Size { what, found, expected: expected.max(1) })
}

impl PsnrMeter {
    /// Adds an image of 8-bit sRGB pixels; returns its PSNR \[dB\] over all pixels and channels.
    ///
    /// # Errors
    /// Images of different or zero size.
    pub fn add(&mut self, rendered: &[[u8; 3]], truth: &[[u8; 3]]) -> Result<f64, MetricsError> {
        same_size("rendered colour pixels", rendered.len(), truth.len())?;
        let square = |(a, b): (&u8, &u8)| u64::from(a.abs_diff(*b)).pow(2);
        let sum: u64 = rendered.iter().flatten().zip(truth.iter().flatten()).map(square).sum();
        let mse = sum as f64 / (3 * truth.len()) as f64;
        let db = psnr_db(mse);
        self.min_db = if self.images == 0 { db } else { self.min_db.min(db) };
        self.images += 1;
        self.sum_db += db;
        self.sum_mse += mse;
        Ok(db)
    }

    /// Returns the figures so far, `None` without images.
    pub fn report(&self) -> Option<PsnrReport> {
        (self.images > 0).then(|| PsnrReport {
            protocol_id: crate::protocol::PSNR_VIEWS.into(),
            protocol: "PSNR: 8-bit sRGB, peak 255, all pixels and channels".into(),
            images: self.images,
            mean_of_psnr_db: self.sum_db / self.images as f64,
            psnr_of_mean_mse_db: psnr_db(self.sum_mse / self.images as f64),
            min_db: self.min_db,
        })
    }
}

/// Depth L1 of views.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DepthReport {
    /// Id of the protocol, to compare by ([`crate::protocol`]).
    pub protocol_id: String,
    /// What the figures mean.
    pub protocol: String,
    /// Number of images.
    pub images: usize,
    /// Pixels with both depths, over all images.
    pub pixels: u64,
    /// Mean |rendered - sensor| over those pixels \[cm\].
    pub l1_cm: f64,
    /// Mean of rendered - sensor over those pixels \[cm\]: negative is towards the camera.
    pub bias_cm: f64,
    /// Mean over the images of each one's mean \[cm\].
    pub mean_of_image_l1_cm: f64,
    /// Share of the pixels with sensor depth that have a rendered depth too, 0 to 1.
    pub coverage: f64,
}

/// Collects images for a [`DepthReport`].
#[derive(Clone, Debug, Default)]
pub struct DepthMeter {
    images: usize,
    measured_images: usize,
    both: u64,
    sensor: u64,
    sum_m: f64,
    sum_signed_m: f64,
    sum_of_means_m: f64,
}

impl DepthMeter {
    /// Adds an image: rendered depth along z \[m\], and sensor depth in units of `unit_m`. Values
    /// that are 0, negative or not finite are invalid. Returns the image's mean error \[m\] if
    /// any pixel has both.
    ///
    /// # Errors
    /// Images of different or zero size.
    pub fn add(
        &mut self,
        rendered_m: &[f32],
        sensor: &[u16],
        unit_m: f64,
    ) -> Result<Option<f64>, MetricsError> {
        same_size("rendered depth pixels", rendered_m.len(), sensor.len())?;
        let (mut sum, mut signed, mut both) = (0.0, 0.0, 0u64);
        for (&r, &s) in rendered_m.iter().zip(sensor).filter(|(_, s)| **s > 0) {
            self.sensor += 1;
            if r.is_finite() && r > 0.0 {
                let difference = f64::from(r) - f64::from(s) * unit_m;
                both += 1;
                sum += difference.abs();
                signed += difference;
            }
        }
        self.images += 1;
        self.both += both;
        self.sum_m += sum;
        self.sum_signed_m += signed;
        if both == 0 {
            return Ok(None);
        }
        self.measured_images += 1;
        self.sum_of_means_m += sum / both as f64;
        Ok(Some(sum / both as f64))
    }

    /// Returns the figures so far, `None` when no pixel had both depths.
    pub fn report(&self) -> Option<DepthReport> {
        (self.both > 0).then(|| DepthReport {
            protocol_id: crate::protocol::DEPTH_VIEWS.into(),
            protocol: "Depth L1, views: rendered against sensor depth, pixels with both".into(),
            images: self.images,
            pixels: self.both,
            l1_cm: 100.0 * self.sum_m / self.both as f64,
            bias_cm: 100.0 * self.sum_signed_m / self.both as f64,
            mean_of_image_l1_cm: 100.0 * self.sum_of_means_m / self.measured_images as f64,
            coverage: self.both as f64 / self.sensor as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psnr_of_known_images() {
        let mut meter = PsnrMeter::default();
        assert!(meter.report().is_none());
        let black = [[0u8; 3]; 4];
        // An error of 10 in every channel: 20 log10(25.5).
        let db = meter.add(&[[10; 3]; 4], &black).unwrap();
        assert!((db - 28.130_803_608_679_1).abs() < 1e-9, "{db}");
        // One channel of one pixel of 4 off by 255: MSE = 255^2 / 12.
        let mut one = black;
        one[2][1] = 255;
        assert!((meter.add(&one, &black).unwrap() - 10.0 * 12f64.log10()).abs() < 1e-9);
        let r = meter.report().unwrap();
        assert!(
            (r.mean_of_psnr_db - (28.130_803_608_679_1 + 10.791_812_460_476_2) / 2.0).abs() < 1e-9
        );
        let mse = (100.0 + 65025.0 / 12.0) / 2.0;
        assert!((r.psnr_of_mean_mse_db - 10.0 * (65025.0f64 / mse).log10()).abs() < 1e-9);
        assert!(r.psnr_of_mean_mse_db < r.mean_of_psnr_db);
        assert_eq!(meter.add(&black, &black), Ok(MAX_PSNR_DB));
        assert!(meter.add(&black[..3], &black).is_err() && meter.add(&[], &[]).is_err());
    }

    #[test]
    fn depth_counts_only_pixels_with_both() {
        let mut meter = DepthMeter::default();
        let rendered = [1.02, 0.0, f32::NAN, 1.95, 7.0];
        let mean = meter.add(&rendered, &[1000, 1000, 1000, 2000, 0], 1e-3).unwrap().unwrap();
        assert!((mean - 0.035).abs() < 1e-6);
        assert_eq!(meter.add(&[0.0; 2], &[500, 0], 1e-3), Ok(None));
        let r = meter.report().unwrap();
        assert!((r.l1_cm - 3.5).abs() < 1e-5 && (r.bias_cm + 1.5).abs() < 1e-5, "{r:?}");
        assert_eq!((r.images, r.pixels, r.coverage), (2, 2, 0.4));
        assert!(meter.add(&rendered, &[1], 1.0).is_err());
        assert!(DepthMeter::default().report().is_none());
    }
}
