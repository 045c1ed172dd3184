//! Files of frames and what is written beside them: the fitted profile as CSV, the plot as SVG and PNG.

use crate::campaign::file::read_input;
use crate::cli::PNG_ZOOM;
use crate::parameters::shown;
use crate::report::profile_plot::{self, TrialPlot};
use crate::report::raster;
use crate::study::calibrate::TrialFit;
use crate::study::calibrate::frames::{self, BadFrames, FramesError, Trial};
use std::collections::HashSet;
use std::error::Error;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// Largest file of frames, in bytes.
const LARGEST_FRAMES: u64 = 64 << 20;

/// The frames of one file and the files made from it.
pub(super) struct Sheet {
    path: PathBuf,
    pub(super) trials: Vec<Trial>,
    pub(super) csv: PathBuf,
    pub(super) svg: PathBuf,
    png: PathBuf,
}

/// Reads all files, and finds out whether their fits can be written before anything is computed.
pub(super) fn read(paths: &[PathBuf]) -> Result<Vec<Sheet>, Box<dyn Error>> {
    let (mut sheets, mut errors, mut seen) = (Vec::new(), Vec::new(), HashSet::new());
    for path in paths {
        let bytes =
            read_input(path, LARGEST_FRAMES).map_err(|source| FramesError::Unreadable { path: path.clone(), source });
        match bytes.and_then(|bytes| frames::parse(&shown(path), bytes)) {
            Ok(trials) => {
                let [csv, svg, png] = ["fit.csv", "fit.svg", "fit.png"].map(|kind| path.with_extension(kind));
                sheets.push(Sheet { path: path.clone(), trials, csv, svg, png });
            }
            Err(error) => errors.push(error),
        }
    }
    if !errors.is_empty() {
        return Err(BadFrames(errors).into());
    }
    for sheet in &sheets {
        if !seen.insert(&sheet.csv) {
            let (path, csv) = (shown(&sheet.path), shown(&sheet.csv));
            return Err(format!(
                "{path}: another file of frames has its fit in {csv}, too; name each once, and differently"
            )
            .into());
        }
        let folder = folder(&sheet.path);
        tempfile::tempfile_in(folder).map_err(|error| {
            format!("{}: no fit can be written here: {error}; copy the frames to a folder of yours", shown(folder))
        })?;
    }
    Ok(sheets)
}

impl Sheet {
    /// Writes the fits of its trials, each file whole or not at all.
    pub(super) fn write(&self, fits: &[(&TrialFit, &String)]) -> Result<(), Box<dyn Error>> {
        let mut out = csv::Writer::from_writer(Vec::new());
        let has_names = self.trials.iter().any(|trial| trial.name.is_some());
        let header = ["h", "v_g", "shape", "v_g_exp", "shape_exp", "trial"];
        out.write_record(&header[..header.len() - usize::from(!has_names)])?;
        for (trial, (fit, _)) in self.trials.iter().zip(fits) {
            for frame in &trial.frames {
                let [v_g, shape] =
                    fit.profile.at(frame.h).map_or([String::new(), String::new()], |pair| pair.map(|x| x.to_string()));
                let cells = [frame.h.to_string(), v_g, shape, frame.v_g.to_string(), frame.shape.to_string()];
                out.write_record(cells.iter().chain(&trial.name))?;
            }
        }
        write_whole(&self.csv, &out.into_inner()?)?;
        let plots: Vec<_> =
            self.trials.iter().zip(fits).map(|(trial, (fit, name))| TrialPlot::of(name, trial, fit)).collect();
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let title = format!("{name}: frames (points) and simulation (lines)");
        let picture = profile_plot::svg(&title, &plots);
        write_whole(&self.svg, picture.as_bytes())?;
        write_whole(&self.png, &raster::png(&picture, PNG_ZOOM)?)
    }
}

/// A file that is there whole or not at all.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    let wrong = |error: std::io::Error| format!("{}: {error}; free some space or choose another folder", shown(path));
    // As any new file, not for its owner's eyes only.
    let permissions = std::fs::Permissions::from_mode(0o666);
    let mut file = tempfile::Builder::new().permissions(permissions).tempfile_in(folder(path)).map_err(wrong)?;
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(wrong)?;
    file.persist(path).map_err(|error| wrong(error.error))?;
    Ok(())
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Names of all trials: of their file, of their column, or both where both are needed.
pub(super) fn names(sheets: &[Sheet]) -> Vec<String> {
    let stem = |sheet: &Sheet| sheet.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = |sheet: &Sheet, trial: &Trial| match &trial.name {
        Some(name) if sheets.len() > 1 => format!("{}: {name}", stem(sheet)),
        Some(name) => name.clone(),
        None => stem(sheet),
    };
    sheets.iter().flat_map(|sheet| sheet.trials.iter().map(move |trial| name(sheet, trial))).collect()
}
