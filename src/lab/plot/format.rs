//! The file formats that plots are written in.

/// The file format of a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlotFormat {
    /// Raster image.
    Png,
    /// Vector graphics.
    Svg,
}

impl PlotFormat {
    /// The format that the extension of `path` names.
    pub fn of(path: &std::path::Path) -> Result<Self, String> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("svg") => Ok(Self::Svg),
            _ => Err(format!("{}: the plot must end in .png or .svg", path.display())),
        }
    }
}
