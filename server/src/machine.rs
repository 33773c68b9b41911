//! Memory that this process may have: that of the machine, or less where a control group or a limit of the process
//! says so.
//!
//! Reads the files in which Linux tells; elsewhere, or where they cannot be read, there is no limit to respect.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Memory (bytes) where the system does not say.
const UNKNOWN: u64 = 4 << 30;

/// Bytes that this process may have.
pub(crate) fn memory_bytes() -> u64 {
    let read = |path: &Path| fs::read_to_string(path).ok();
    let limits = [
        read(Path::new("/proc/meminfo")).as_deref().and_then(total_of),
        read(Path::new("/proc/self/limits")).as_deref().and_then(address_space_of),
        read(Path::new("/proc/self/cgroup")).and_then(|groups| group_limit(&groups, &read)),
    ];
    limits.into_iter().flatten().min().unwrap_or(UNKNOWN)
}

/// `MemTotal` of /proc/meminfo (bytes).
fn total_of(meminfo: &str) -> Option<u64> {
    let kilobytes = meminfo.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    kilobytes.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// Of an address space, the share that memory can fill: stacks and arenas are as large as they may ever become.
const FILLED: f64 = 0.6;

/// What the soft limit on the address space in /proc/self/limits leaves for memory (bytes); none where there is none.
fn address_space_of(limits: &str) -> Option<u64> {
    let limit = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: u64 = limit.split_whitespace().next()?.parse().ok()?;
    Some((limit as f64 * FILLED) as u64)
}

/// The least limit (bytes) of the process's control groups and all groups around them, of version 2 and 1.
fn group_limit(groups: &str, read: &impl Fn(&Path) -> Option<String>) -> Option<u64> {
    let files = groups.lines().filter_map(|line| {
        let [_, controllers, path] = line.splitn(3, ':').collect::<Vec<_>>()[..] else { return None };
        match controllers {
            "" => Some(("/sys/fs/cgroup", path, "memory.max")),
            _ if controllers.split(',').any(|name| name == "memory") => {
                Some(("/sys/fs/cgroup/memory", path, "memory.limit_in_bytes"))
            }
            _ => None,
        }
    });

    let limits = files.flat_map(|(root, path, file)| {
        // Where a group is a namespace's root, its path names what is not to be seen here.
        let group = PathBuf::from(format!("{root}{path}"));
        let around = group.ancestors().map(Path::to_path_buf).collect::<Vec<_>>();
        around.into_iter().filter(move |group| group.starts_with(root)).map(move |group| group.join(file))
    });
    // "max" stands for no limit in version 2, a number beyond all memory in version 1.
    limits.filter_map(|file| read(&file)?.trim().parse().ok()).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_of_linux_are_read() {
        assert_eq!(total_of("MemTotal:       24104724 kB\nMemFree:  1 kB\n"), Some(24_104_724 * 1024));
        assert_eq!(total_of("MemFree: 1 kB"), None);
        let limits =
            "Limit   Soft Limit  Hard Limit  Units\nMax address space         1073741824  unlimited  bytes\n";
        assert_eq!(address_space_of(limits), Some(644_245_094));
        assert_eq!(address_space_of("Max address space  unlimited  unlimited  bytes"), None);
        assert!(memory_bytes() > 1 << 20);
    }

    #[test]
    fn the_least_limit_of_a_group_and_those_around_it_counts() {
        let read = |path: &Path| {
            let limit = match path.to_str()? {
                "/sys/fs/cgroup/a/b/memory.max" => "max\n",
                "/sys/fs/cgroup/a/memory.max" => "2000\n",
                "/sys/fs/cgroup/memory/docker/x/memory.limit_in_bytes" => "9223372036854771712\n",
                "/sys/fs/cgroup/memory/memory.limit_in_bytes" => "3000\n",
                _ => return None,
            };
            Some(limit.to_owned())
        };
        assert_eq!(group_limit("0::/a/b\n", &read), Some(2000));
        assert_eq!(group_limit("5:cpu,memory:/docker/x\n1:name=systemd:/y\n", &read), Some(3000));
        assert_eq!(group_limit("0::/elsewhere\n", &read), None);
        assert_eq!(group_limit("", &read), None);
    }
}
