// What a batch asks of the kernels: bits of params.flags.
// Pixels are taken in order from `first`, not drawn.
const FLAG_DENSE: u32 = ${FLAG_DENSE}u;
// Depth images guide the samples of rays that have a depth.
const FLAG_GUIDED: u32 = ${FLAG_GUIDED}u;
// Write gradients with respect to sample positions (tracking, joint pose refinement).
const FLAG_POSE: u32 = ${FLAG_POSE}u;
// Write gradients with respect to plane features (mapping).
const FLAG_MAP: u32 = ${FLAG_MAP}u;
// Mask rays whose depth error passes the outlier threshold.
const FLAG_MASK: u32 = ${FLAG_MASK}u;
// Class of a ray: that of its nearest anchor, not the head's.
const FLAG_ANCHORS: u32 = ${FLAG_ANCHORS}u;
