//! Repeats the evaluation of K. Smith's paper *CSC 473 Harmonic Coordinates*, and adds the embedded method for
//! comparison. "The paper" in this program means Smith's.
//!
//! Figures are numbered as in the paper: 2 to 5 are reconstructions, 6 is a deformation, 7 shows the solver's delta
//! (`BindReport::delta_history`) over time, 8 to 11 show times to completion, 12 shows the error at rest.
//!
//! Arguments: the folder to write to (default `evaluation`), the number of timed binds per case (default 3), and the
//! cells of the finest grid (default 64; grids of half and a quarter of that are run as well). The input is the first
//! sample, or the files in the environment variables `CAGEWORK_BENCH_MESH` and `CAGEWORK_BENCH_CAGE`.

mod cases;
mod files;
mod pictures;
mod plots;
mod spread;
mod words;

use std::error::Error;
use std::path::PathBuf;

use cagework_benches::files_of_environment;
use cagework_cage::samples;
use cagework_core::{Cage, PolygonMesh};
use cagework_gpu::{ContextOptions, GpuContext};
use cagework_io::Model;
use glam::DVec3;
use pollster::block_on;

use cases::{Evaluation, Input};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "evaluation".to_owned()));
    let runs = arguments.next().map_or(Ok(3), |n| n.parse())?;
    let grid = arguments.next().map_or(Ok(64), |n| n.parse())?;
    std::fs::create_dir_all(&folder)?;
    let input = input()?;
    let gpu = block_on(GpuContext::new(&ContextOptions::default()));
    let evaluation = Evaluation::run(&input, (grid, runs), gpu.as_ref())?;
    let mut files = files::all(&input, &evaluation)?;
    if let Ok(context) = gpu {
        files.extend(pictures::all(context, &input, &evaluation)?);
    }
    for (name, contents) in files {
        std::fs::write(folder.join(name), contents)?;
    }
    println!("{}\nwrote {}", words::verdicts(&evaluation), folder.join("report.md").display());
    Ok(())
}

fn input() -> Result<Input, Box<dyn Error>> {
    if let Some((model, cage)) = files_of_environment() {
        return Ok(Input { name: model.name.clone(), model, cage });
    }
    let sample = samples::all().first().and_then(|first| samples::build(first.id)).ok_or("no sample")?;
    let faces = sample.mesh.triangles.iter().map(|t| t.to_vec()).collect();
    let mesh = PolygonMesh { positions: sample.mesh.positions, faces };
    let model = Model::of_mesh("sample.obj", &mesh, DVec3::ZERO)?;
    Ok(Input { name: format!("sample {}", sample.name), model, cage: Cage::new(&sample.cage)? })
}
