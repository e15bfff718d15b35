//! Test support: shared fixtures of the integration tests in `tests/`.
