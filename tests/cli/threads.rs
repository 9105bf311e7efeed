//! The number of threads is the program's own decision: `--threads`, else the cores that it may use, never more.

use std::process::{Command, Output};

const PROGRAM: &str = env!("CARGO_BIN_EXE_bvhscope");

fn cores() -> u64 {
    std::thread::available_parallelism().map_or(1, usize::from) as u64
}

fn run(program: &[&str], args: &[&str], environment: &[(&str, &str)]) -> Output {
    let all = [program, &[PROGRAM], args].concat();
    Command::new(all[0]).args(&all[1..]).envs(environment.iter().copied()).output().unwrap()
}

/// `threads` of each row.
fn threads(output: &Output) -> Vec<u64> {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout);
    text.lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap()["threads"].as_u64().unwrap())
        .collect()
}

#[test]
fn the_environment_does_not_decide_how_many_threads_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("a.png");
    let small = ["builtin:teapot:1", "--size", "8x8", "--json"];
    let info: &[&str] = &["info", "builtin:teapot:1", "--json"];
    let render = [&["render"], &small[..], &["-o", picture.to_str().unwrap()]].concat();
    let bench = [&["bench"], &small[..], &["--repeat", "1", "--container", "box"]].concat();
    for (name, value) in
        [("RAYON_NUM_THREADS", "99999999999"), ("RAYON_NUM_THREADS", "20000"), ("RAYON_RS_NUM_CPUS", "20000")]
    {
        for args in [info, &render, &bench] {
            assert_eq!(threads(&run(&[], args, &[(name, value)])), [cores()], "{name}={value} {args:?}");
        }
        let scaling = [&["scaling"], &small[..], &["--repeat", "1"]].concat();
        let every: Vec<u64> = (1..=cores()).collect();
        assert_eq!(threads(&run(&[], &scaling, &[(name, value)])), every, "{name}={value}");
    }
}

#[test]
fn more_threads_than_cores_are_refused_with_a_note() {
    for args in [&["info", "builtin:teapot:1", "--json"][..], &["bench", "builtin:teapot:1", "--size", "8x8", "--json"]]
    {
        let output = run(&[], &[args, &["--threads", "1024"]].concat(), &[]);
        assert!(threads(&output).iter().all(|&threads| threads == cores().min(1024)));
        let error = String::from_utf8_lossy(&output.stderr);
        let said = error.contains(&format!("--threads 1024: this process may use {} at once", cores()));
        assert!(said || cores() >= 1024, "{error}");
    }
}

#[test]
fn a_process_bound_to_one_core_has_one_thread() {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap();
    let first = allowed.trim().split(['-', ',']).next().unwrap();
    let taskset = ["taskset", "-c", first];
    assert_eq!(threads(&run(&taskset, &["info", "builtin:teapot:1", "--json"], &[])), [1]);
}
