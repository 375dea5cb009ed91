//! Arguments for the size of a written GLB.

use std::path::Path;

use cagework_io::{CompactOptions, Compression, compact};
use clap::Args;

use super::ModelOutput;
use crate::error::CliError;

/// Arguments for the size of a written GLB.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct SizeArgs {
    /// Store normals, tangents, texture coordinates, colours and joint weights of a .glb or .vrm as integers
    /// (KHR_mesh_quantization). Positions stay floats.
    #[arg(long)]
    quantize: bool,
    /// Compress the geometry and clips of a .glb or .vrm: meshopt (EXT_meshopt_compression) is lossless; with --quantize,
    /// positions are also rounded to 16 bits.
    #[arg(long, default_value_t, value_name = "KIND", value_parser = super::words::<Compression>())]
    compress: Compression,
}

impl SizeArgs {
    fn options(self) -> CompactOptions {
        CompactOptions { quantize: self.quantize, compress: self.compress }
    }

    /// Rejects the options for output formats other than glTF.
    ///
    /// # Errors
    /// If an option is given and the output is not glTF.
    pub(crate) fn check(self, output: &ModelOutput) -> Result<(), CliError> {
        self.options().require(output.format).map_err(|problem| CliError::file(&output.path, problem))
    }

    /// Quantizes and compresses an encoded GLB as the options say; without options, returns it unchanged.
    ///
    /// # Errors
    /// If the GLB cannot be read.
    pub(crate) fn apply(self, bytes: Vec<u8>, output: &Path) -> Result<Vec<u8>, CliError> {
        compact(bytes, self.options()).map_err(|e| CliError::file(output, e))
    }
}
