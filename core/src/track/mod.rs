//! Estimating the camera's pose of each frame.
pub mod gauss_newton;
pub mod odometry;
