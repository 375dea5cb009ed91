//! Completions for shells and manual pages, generated from the definition of the arguments.

use std::fs::create_dir_all;
use std::io;
use std::path::Path;

use clap::CommandFactory as _;
use clap_complete::Shell;

use crate::args::{Cli, ShellFilesArgs};
use crate::error::CliError;

/// Shells whose completions are written.
const SHELLS: [Shell; 4] = [Shell::Bash, Shell::Fish, Shell::PowerShell, Shell::Zsh];

pub(crate) fn run(args: &ShellFilesArgs) -> Result<(), CliError> {
    write_all(&args.folder).map_err(|e| CliError::file(&args.folder, e))
}

/// Writes completions into `completions`, and pages of section 1 into `man`.
fn write_all(folder: &Path) -> io::Result<()> {
    let [completions, pages] = ["completions", "man"].map(|name| folder.join(name));
    create_dir_all(&completions)?;
    create_dir_all(&pages)?;
    for shell in SHELLS {
        clap_complete::generate_to(shell, &mut Cli::command(), "cagework", &completions)?;
    }
    clap_mangen::generate_to(Cli::command(), &pages)
}
