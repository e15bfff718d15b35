//! Estimating the camera's pose of each frame.
pub mod odometry;
