//! From SVG to pixels: the same bytes on every machine, because the font comes with the program.

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb::Database};
use std::sync::{Arc, OnceLock};

/// A picture that could not be turned into pixels.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RasterError {
    /// The document is not SVG.
    #[error("the picture is not valid SVG ({0}); please report it, and use -o FILE.svg meanwhile")]
    Svg(#[from] resvg::usvg::Error),
    /// The picture does not fit in memory.
    #[error("a picture of {0} x {1} pixels is too large; use -o FILE.svg, or leave out --path")]
    Size(u32, u32),
    /// The pixels could not be packed.
    #[error("the picture could not be packed: {0}")]
    Packing(String),
}

/// DejaVu Sans, upright and bold.
fn fonts() -> Arc<Database> {
    static FONTS: OnceLock<Arc<Database>> = OnceLock::new();
    let load = || {
        let mut fonts = Database::new();
        fonts.load_font_data(dejavu::sans::regular().to_vec());
        fonts.load_font_data(dejavu::sans::bold().to_vec());
        fonts.set_sans_serif_family("DejaVu Sans");
        Arc::new(fonts)
    };
    FONTS.get_or_init(load).clone()
}

/// The picture, `zoom` times as large.
///
/// # Errors
/// [`RasterError`].
pub(crate) fn pixels(svg: &str, zoom: f32) -> Result<Pixmap, RasterError> {
    let tree = Tree::from_str(svg, &Options { fontdb: fonts(), ..Options::default() })?;
    let size = tree.size();
    let [width, height] = [size.width(), size.height()].map(|side| (side * zoom).round() as u32);
    let mut pixels = Pixmap::new(width, height).ok_or(RasterError::Size(width, height))?;
    // The picture may cover the last row in part only, so white lies below it.
    pixels.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(zoom, zoom), &mut pixels.as_mut());
    Ok(pixels)
}

/// The picture as a PNG file, `zoom` times as large.
///
/// # Errors
/// [`RasterError`].
pub(crate) fn png(svg: &str, zoom: f32) -> Result<Vec<u8>, RasterError> {
    pixels(svg, zoom)?.encode_png().map_err(|error| RasterError::Packing(error.to_string()))
}
