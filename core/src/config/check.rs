//! What a configuration must hold to make sense.
use super::{Config, ConfigError, Head};
use crate::settings;
use alloc::{format, string::ToString};

impl Config {
    /// Checks every setting's range, and what settings must hold together.
    ///
    /// # Errors
    /// [`ConfigError::OutOfRange`] with the path of the setting.
    pub fn validate(&self) -> Result<(), ConfigError> {
        settings::validate(self)?;
        let f = &self.field;
        // Growing the map copies cells: every cell edge must divide the step it grows by.
        for (name, cell) in [
            ("geometry_coarse_m", f.geometry_coarse_m),
            ("geometry_fine_m", f.geometry_fine_m),
            ("surface_fine_m", f.surface_fine_m),
        ] {
            let ratio = f.surface_coarse_m / cell;
            let whole = num_traits::Float::round(ratio).max(1.0);
            // Written so that a ratio that is no number fails.
            let divides = num_traits::Float::abs(ratio - whole) < 1e-6;
            if !divides {
                return Err(ConfigError::OutOfRange {
                    path: format!("field.{name}"),
                    found: cell.to_string(),
                    expected: "a whole fraction of field.surface_coarse_m".into(),
                });
            }
        }
        if self.semantics.head == Head::Sample && !cfg!(feature = "sample-head") {
            return Err(ConfigError::OutOfRange {
                path: "semantics.head".into(),
                found: "sample".into(),
                expected: "ray, or a build with the feature `sample-head`".into(),
            });
        }
        let m = &self.mapping;
        if m.rays < m.window {
            return Err(ConfigError::OutOfRange {
                path: "mapping.rays".into(),
                found: m.rays.to_string(),
                expected: format!("at least mapping.window, {}", m.window),
            });
        }
        Ok(())
    }
}
