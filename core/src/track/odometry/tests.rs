//! Tests on rendered scenes.
