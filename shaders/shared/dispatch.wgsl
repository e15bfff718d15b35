// Linear ids of a dispatch spread over x and y (workgroups_1d).
fn linear_workgroup(workgroup: vec3<u32>, workgroups: vec3<u32>) -> u32 {
    return workgroup.x + workgroups.x * (workgroup.y + workgroups.y * workgroup.z);
}

fn linear_invocation(workgroup: vec3<u32>, workgroups: vec3<u32>, local: u32) -> u32 {
    return linear_workgroup(workgroup, workgroups) * WORKGROUP_SIZE + local;
}
