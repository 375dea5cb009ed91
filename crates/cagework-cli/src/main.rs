//! The `cagework` command: binds a mesh to a cage by harmonic coordinates, deforms it, and reports the accuracy.
//!
//! Results go to stdout and errors to stderr, as JSON with `--json`. Exit codes: 0 success, 1 error, 2 invalid command
//! line.

mod args;
mod bind;
mod cage;
mod card;
mod check;
mod controls;
mod deform;
mod demo;
mod error;
mod field;
mod files;
mod fit;
mod gpu;
mod info;
mod load;
mod pose;
mod progress;
mod proportions;
mod pull;
mod refit;
mod render;
mod shell_files;
mod signals;
mod transfer;

use std::process::ExitCode;

use args::{Cli, Command};
use clap::Parser as _;

/// Allocator that reuses large freed blocks. A bind allocates and frees about 30 MB within milliseconds. The system
/// allocator returns such blocks to the kernel each time, and the resulting page faults would take a fifth of the
/// bind's time at g = 64.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let cli = Cli::parse();
    signals::listen(files::abandon);
    if cli.quiet {
        files::be_quiet();
    }
    let outcome = match &cli.command {
        Command::Info(args) => info::run(args, cli.json),
        Command::Bind(args) => bind::run(args, cli.json),
        Command::Deform(args) => deform::run(args, cli.json),
        Command::Proportions(args) => proportions::run(args, cli.json),
        Command::Map(args) => field::run(args, cli.json),
        Command::Refit(args) => refit::run(args, cli.json),
        Command::Transfer(args) => transfer::run(args, cli.json),
        Command::Pull(args) => pull::run(args, cli.json),
        Command::Fit(args) => fit::run(args, cli.json),
        Command::Render(args) => render::run(args, cli.json),
        Command::Cage(args) => cage::run(args, cli.json),
        Command::Check(args) => check::run(args, cli.json),
        Command::Demo(args) => demo::run(args, cli.json),
        Command::ShellFiles(args) => shell_files::run(args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            error::print_error(&error.message(), error.hint(), cli.json);
            ExitCode::FAILURE
        }
    }
}
