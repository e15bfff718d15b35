//! Memory of this process, and of the machine.

/// Peak resident memory \[bytes\], or why it is not known.
pub fn peak_host_bytes() -> Result<u64, String> {
    #[cfg(target_os = "linux")]
    {
        let status = std::fs::read_to_string("/proc/self/status")
            .map_err(|e| format!("/proc/self/status cannot be read: {e}"))?;
        parse_high_water(&status).ok_or_else(|| "no VmHWM in /proc/self/status".to_owned())
    }
    #[cfg(not(target_os = "linux"))]
    Err(format!("not measured on {}", std::env::consts::OS))
}

/// Memory that is free for this process \[bytes\], where it is known.
pub fn available_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib << 10)
}

#[cfg(any(target_os = "linux", test))]
fn parse_high_water(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib << 10)
}

#[cfg(test)]
mod tests {
    #[test]
    fn high_water_mark_is_read() {
        let text = "Name:\tx\nVmHWM:\t    2048 kB\nVmRSS:\t 1 kB\n";
        assert_eq!(super::parse_high_water(text), Some(2048 * 1024));
        assert_eq!(super::parse_high_water("VmRSS: 1 kB"), None);
    }
}
