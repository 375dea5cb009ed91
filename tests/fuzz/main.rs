//! Runs damaged files through all readers and the code that uses their results. Each file must lead to a result or an
//! error, within seconds and without a panic.
//!
//! `cargo xtask fuzz --minutes 60` takes the seed from the clock and prints it; `--seed 1` makes runs
//! repeatable. `--page 60` reads the inputs with the page's wasm modules instead (`page.mjs`), once `cargo xtask page` has
//! built them. Failing inputs are written to `target/fuzz`, and `cargo xtask fuzz FILE` repeats one. Inputs
//! that failed in the past are in `found` and run first.
//!
//! A child process runs the inputs, since stack overflow and memory exhaustion end the process. It prints the
//! number of each input before running it, so the parent knows which input failed.

mod common;
mod inputs;
mod survive;

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Limit on CPU time per input. The slowest input takes about 1 s.
const CPU_TIME_LIMIT: Duration = Duration::from_secs(10);

/// Limit on wall-clock time per input, for a process that waits or gets no CPU time.
const WALL_TIME_LIMIT: Duration = Duration::from_secs(600);

/// Address space limit of the child process, KiB: 4 GiB. Inputs need a few MiB, so only a runaway allocation reaches
/// it.
const MEMORY_KIB: &str = "4194304";

/// Number of failed inputs after which the run ends.
const MAX_FAILURES: u64 = 50;

const USAGE: &str = "usage: cargo xtask fuzz [--minutes N] [--seed S] | --page N | FILE ...";

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    match args.as_slice() {
        ["--try", seed, first] => {
            if let (Ok(seed), Ok(first)) = (seed.parse(), first.parse()) {
                try_from(seed, first);
                return ExitCode::SUCCESS;
            }
            ExitCode::FAILURE
        }
        ["--page", minutes] => fuzz_page(minutes),
        ["--write", seed] => {
            if let Ok(seed) = seed.parse() {
                write_all(seed);
            }
            ExitCode::FAILURE
        }
        ["--try", file] => {
            println!("0");
            match std::fs::read(file) {
                Ok(bytes) => survive::survive(&bytes),
                Err(e) => {
                    eprintln!("cannot read {file}: {e}");
                    return ExitCode::FAILURE;
                }
            }
            ExitCode::SUCCESS
        }
        [] => fuzz(1.0, None),
        ["--minutes", minutes] => minutes.parse().map_or_else(|_| usage(), |m| fuzz(m, None)),
        ["--minutes", minutes, "--seed", seed] => match (minutes.parse(), seed.parse()) {
            (Ok(minutes), Ok(seed)) => fuzz(minutes, Some(seed)),
            _ => usage(),
        },
        [first, ..] if first.starts_with("--") => usage(),
        files => try_files(files),
    }
}

/// Damaged files that failed in the past.
fn found() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/found");
    let entries = std::fs::read_dir(folder).expect("the folder exists");
    entries.map(|entry| entry.expect("the entry is readable").path().display().to_string()).collect()
}

fn usage() -> ExitCode {
    eprintln!("{USAGE}");
    ExitCode::from(2)
}

/// Number of inputs that a child process runs. Software adapters keep about 1 MB per picture until the process ends.
const N_PER_PROCESS: u64 = 1000;

/// Runs inputs until the process is killed, at most [`N_PER_PROCESS`].
fn try_from(seed: u64, first: u64) {
    let mut inputs = inputs::Inputs::new(seed);
    let mut out = std::io::stdout().lock();
    for number in first..first + N_PER_PROCESS {
        let written = writeln!(out, "{number}").and_then(|()| out.flush());
        if written.is_err() {
            return;
        }
        survive::survive(&inputs.get(number));
    }
}

/// Runs inputs through the page's wasm modules, in Node.
fn fuzz_page(minutes: &str) -> ExitCode {
    let program = std::env::current_exe().expect("the executable has a path");
    let ended =
        Command::new("node").arg(root().join("tests/fuzz/page.mjs")).arg(program).arg(minutes).status();
    if ended.is_ok_and(|status| status.success()) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Writes inputs to stdout until it is closed, each with its length before it. Read by `page.mjs`.
fn write_all(seed: u64) {
    let mut inputs = inputs::Inputs::new(seed);
    let mut out = std::io::stdout().lock();
    for number in 0.. {
        let input = inputs.get(number);
        let length = (input.len() as u32).to_le_bytes();
        if out.write_all(&length).and_then(|()| out.write_all(&input)).is_err() {
            return;
        }
    }
}

/// The child process and the input numbers it prints.
struct Trial {
    process: Child,
    numbers: Receiver<u64>,
    /// Start of the current input: wall-clock time, and CPU time of the process.
    since: (Instant, Duration),
}

impl Trial {
    fn start(args: &[&str]) -> Self {
        let program = std::env::current_exe().expect("the executable has a path");
        let mut process = Command::new("sh")
            .args(["-c", &format!("ulimit -v {MEMORY_KIB} && exec \"$0\" --try \"$@\"")])
            .arg(program)
            .args(args)
            .stdout(Stdio::piped())
            .spawn()
            .expect("sh exists");
        let lines = BufReader::new(process.stdout.take().expect("stdout is piped")).lines();
        let (send, numbers) = channel();
        std::thread::spawn(move || {
            for number in lines.map_while(Result::ok).filter_map(|line| line.parse().ok()) {
                if send.send(number).is_err() {
                    return;
                }
            }
        });
        Self { process, numbers, since: (Instant::now(), Duration::ZERO) }
    }

    /// Number of the next input, and CPU time of the previous one. Returns an error if the process ended or exceeded a
    /// limit.
    fn next(&mut self) -> Result<(u64, Duration), RecvTimeoutError> {
        loop {
            let number = self.numbers.recv_timeout(Duration::from_secs(1));
            let now = (Instant::now(), self.busy().unwrap_or(self.since.1 + self.since.0.elapsed()));
            let took = now.1.saturating_sub(self.since.1);
            match number {
                Ok(number) => {
                    self.since = now;
                    return Ok((number, took));
                }
                Err(RecvTimeoutError::Timeout)
                    if took < CPU_TIME_LIMIT && self.since.0.elapsed() < WALL_TIME_LIMIT => {}
                Err(e) => return Err(e),
            }
        }
    }

    /// CPU time of the process, from /proc in ticks of 10 ms.
    fn busy(&self) -> Option<Duration> {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.process.id())).ok()?;
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        let ticks = |k: usize| fields.get(k)?.parse::<u64>().ok();
        Some(Duration::from_millis(10 * (ticks(11)? + ticks(12)?)))
    }

    /// Waits until the process ends, or kills it if `timed_out` is set. Returns how it ended; `None` on success.
    fn end(mut self, timed_out: bool) -> Option<String> {
        if timed_out {
            // Ignore the error: the process may have exited in the meantime.
            let _ = self.process.kill();
        }
        match self.process.wait() {
            _ if timed_out => Some(format!("not done after {} s", CPU_TIME_LIMIT.as_secs())),
            Ok(status) if status.success() => None,
            Ok(status) => Some(format!("ended with {status}")),
            Err(e) => Some(e.to_string()),
        }
    }
}

/// Runs the given files, each in its own child process.
fn try_files(files: &[impl AsRef<Path> + std::fmt::Display]) -> ExitCode {
    let mut outcome = ExitCode::SUCCESS;
    for file in files {
        let path = root().join(file);
        let mut trial = Trial::start(&[&path.display().to_string()]);
        let began = Instant::now();
        // The child prints one number, then exits.
        let ended = trial.next().and_then(|_| trial.next());
        match trial.end(matches!(ended, Err(RecvTimeoutError::Timeout))) {
            None => println!("{file}: survived in {} ms", began.elapsed().as_millis()),
            Some(how) => {
                println!("{file}: {how}");
                outcome = ExitCode::FAILURE;
            }
        }
    }
    outcome
}

/// Runs inputs for a number of minutes. Success if none of them fails.
fn fuzz(minutes: f64, seed: Option<u64>) -> ExitCode {
    let clock = || std::time::UNIX_EPOCH.elapsed().map_or(0, |d| d.as_secs());
    let seed = seed.unwrap_or_else(clock);
    println!("fuzz: seed {seed}, {minutes} minutes");
    if try_files(&found()) != ExitCode::SUCCESS {
        return ExitCode::FAILURE;
    }
    let began = Instant::now();
    let until = began + Duration::from_secs_f64(60.0 * minutes.clamp(0.0, 1e5));
    let (mut next, mut failures, mut said) = (0, 0, began);
    let (mut slowest, mut slowest_number) = (Duration::ZERO, 0);
    while Instant::now() < until && failures < MAX_FAILURES {
        let mut trial = Trial::start(&[&seed.to_string(), &next.to_string()]);
        let mut current = next;
        let ended = loop {
            match trial.next() {
                Ok((number, took)) => {
                    if number > current && took > slowest {
                        (slowest, slowest_number) = (took, current);
                    }
                    current = number;
                    if Instant::now() >= until {
                        break None;
                    }
                    if said.elapsed() > Duration::from_secs(60) {
                        said = Instant::now();
                        println!("fuzz: {current} inputs, {failures} failures so far");
                    }
                }
                Err(e) => break Some(e),
            }
        };
        let how = trial.end(ended != Some(RecvTimeoutError::Disconnected));
        // An input interrupted at the end of the time is not counted.
        next = current + u64::from(ended.is_some());
        if let Some(how) = how.filter(|_| ended.is_some()) {
            failures += 1;
            match keep(seed, current) {
                Ok(path) => println!(
                    "fuzz: input {current} of seed {seed} {how}; again: cargo xtask fuzz {}",
                    path.display()
                ),
                Err(e) => {
                    println!("fuzz: input {current} of seed {seed} {how}; its file cannot be written: {e}");
                }
            }
        }
    }
    println!(
        "fuzz: seed {seed}, {next} inputs in {} s, {failures} failures; the slowest, input {slowest_number}, took {} ms",
        began.elapsed().as_secs(),
        slowest.as_millis()
    );
    if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Writes an input to `target/fuzz`; returns its path relative to the repository.
fn keep(seed: u64, number: u64) -> std::io::Result<PathBuf> {
    let path = Path::new("target/fuzz").join(format!("{seed}-{number}"));
    std::fs::create_dir_all(root().join("target/fuzz"))?;
    std::fs::write(root().join(&path), inputs::Inputs::new(seed).get(number))?;
    Ok(path)
}

/// Root of the repository. Tests run in the directory of their crate.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the crate is in the root").to_path_buf()
}
