//! Ranks on two hosts, which are network namespaces of this machine, joined by a bridge: nobody has to be root for them.

use std::{collections::BTreeSet, fs, os::unix::fs::PermissionsExt as _, process::Command};

use serde_json::Value;

use crate::{
    ranks::has_ranks,
    support::{SMALL_SCENE, command, folder, skipped, write_scene},
};

/// Makes the hosts, then runs its arguments; all is gone when that has ended.
const HOSTS: &str = r#"
set -e
mount -t tmpfs none /run
ip link set lo up
ip link add bridge type bridge
ip addr add 10.77.0.1/24 dev bridge
ip link set bridge up
for host in 10.77.0.11 10.77.0.12; do
    ip netns add $host
    ip link add veth${host##*.} type veth peer name eth0 netns $host
    ip link set veth${host##*.} master bridge up
    ip -n $host addr add $host/24 dev eth0
    ip -n $host link set eth0 up
    ip -n $host link set lo up
done
exec "$@"
"#;

/// The way of `mpirun` to a host, instead of ssh.
const AGENT: &str = r#"#!/bin/sh
host=$1; shift
exec nsenter --net="/run/netns/$host" unshare --uts sh -c "hostname node-${host##*.}; $*"
"#;

#[test]
fn ranks_on_two_hosts_have_the_bits_of_one_process() {
    if !has_ranks() {
        return;
    }
    let folder = folder();
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let write = |name: &str, text: &str| fs::write(path(name), text).expect("the file is written");
    write("hosts.sh", HOSTS);
    write("agent.sh", AGENT);
    write("hostfile", "10.77.0.11 slots=2\n10.77.0.12 slots=2\n");
    fs::set_permissions(path("agent.sh"), fs::Permissions::from_mode(0o755)).expect("it may be run");
    let among_hosts = |program: &str| {
        let mut among = Command::new("unshare");
        among.args(["--user", "--map-root-user", "--net", "--mount", "sh", &path("hosts.sh"), program]);
        among
    };
    if !among_hosts("true").output().is_ok_and(|made| made.status.success()) {
        skipped("network namespaces are forbidden here, ranks on several hosts are not tested");
        return;
    }

    let launcher = format!(
        "mpirun --allow-run-as-root -n {{ranks}} --hostfile {} --map-by node --bind-to none --mca plm_rsh_agent {} \
         --mca oob_tcp_if_include 10.77.0.0/24 --mca btl_tcp_if_include 10.77.0.0/24 --mca btl tcp,vader,self \
         --mca pml ob1 -x NAPPE_LINK {{program}}",
        path("hostfile"),
        path("agent.sh")
    );
    let scene = write_scene(folder.path(), &SMALL_SCENE.replace("[12, 12]", "[30, 30]"));
    let run = ["run", &scene, "--steps", "5", "--json"];
    let json = |mut command: Command| -> Value {
        let done = command.output().expect("it starts");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        serde_json::from_slice(&done.stdout).expect("JSON")
    };
    let mut alone = command();
    alone.args(run);
    let mut together = among_hosts(env!("CARGO_BIN_EXE_nappe"));
    together.args(run).args(["--ranks", "4", "--link-address", "10.77.0.1", "--launcher", &launcher]);

    let (alone, together) = (json(alone), json(together));
    assert_eq!(together["state_hash"], alone["state_hash"]);
    let hosts = together["hosts"].as_array().expect("a list");
    let names: BTreeSet<&str> = hosts.iter().filter_map(Value::as_str).collect();
    assert_eq!((hosts.len(), names), (4, BTreeSet::from(["node-11", "node-12"])));
}
