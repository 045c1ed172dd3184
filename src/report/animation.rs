//! Pictures one after the other as an animated GIF, which every browser and slide show plays.
//!
//! All frames share one palette, so that nothing flickers: the 256 most frequent colours of a few frames. The pictures
//! have flat colours, so only shades of smoothed edges are lost.

use crate::report::raster::{RasterError, pixels};
use gif::{Encoder, Frame, Repeat};
use resvg::tiny_skia::Pixmap;
use std::borrow::Cow;
use std::cmp::Reverse;
use std::collections::HashMap;

/// Frames from which the palette is taken.
const PALETTE_FRAMES: usize = 12;

/// Time of the whole animation, and the shortest and longest time of a frame, in hundredths of a second.
const TIMES: [usize; 3] = [1000, 4, 25];

/// How long the last frame stays, in hundredths of a second.
const LAST_FRAME: u16 = 150;

type Colour = [u8; 3];

/// The animation of `frames` pictures, all of one size; `svg(k)` is the k-th.
///
/// # Errors
/// [`RasterError`].
pub(crate) fn gif(frames: usize, zoom: f32, svg: impl Fn(usize) -> String) -> Result<Vec<u8>, RasterError> {
    let packing = |error: gif::EncodingError| RasterError::Packing(error.to_string());
    let step = frames.div_ceil(PALETTE_FRAMES).max(1);
    let mut counts: HashMap<Colour, u64> = HashMap::new();
    let mut size = (0, 0);
    for k in (0..frames).step_by(step) {
        let picture = pixels(&svg(k), zoom)?;
        size = (picture.width(), picture.height());
        colours(&picture).for_each(|colour| *counts.entry(colour).or_default() += 1);
    }
    let palette = palette(counts);
    let side = |length: u32| u16::try_from(length).map_err(|_| RasterError::Size(size.0, size.1));
    let (width, height) = (side(size.0)?, side(size.1)?);
    let mut nearest: HashMap<Colour, u8> = HashMap::new();
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, width, height, &palette.concat()).map_err(packing)?;
    encoder.set_repeat(Repeat::Infinite).map_err(packing)?;
    let [whole, shortest, longest] = TIMES;
    let delay = (whole / frames.max(1)).clamp(shortest, longest) as u16;
    for k in 0..frames {
        let picture = pixels(&svg(k), zoom)?;
        let index = |colour| *nearest.entry(colour).or_insert_with(|| nearest_of(&palette, colour));
        let buffer = Cow::Owned(colours(&picture).map(index).collect::<Vec<u8>>());
        let delay = if k + 1 == frames { LAST_FRAME } else { delay };
        let frame = Frame { width, height, buffer, delay, ..Frame::default() };
        encoder.write_frame(&frame).map_err(packing)?;
    }
    drop(encoder);
    Ok(out)
}

/// The colours of a picture, row by row; pictures are opaque.
fn colours(picture: &Pixmap) -> impl Iterator<Item = Colour> + '_ {
    picture.data().as_chunks::<4>().0.iter().map(|[red, green, blue, _]| [*red, *green, *blue])
}

/// The most frequent colours, by frequency.
fn palette(counts: HashMap<Colour, u64>) -> Vec<Colour> {
    let mut by_count: Vec<_> = counts.into_iter().collect();
    by_count.sort_by_key(|&(colour, count)| (Reverse(count), colour));
    by_count.into_iter().take(256).map(|(colour, _)| colour).collect()
}

/// Index of the nearest colour.
fn nearest_of(palette: &[Colour], colour: Colour) -> u8 {
    let distance = |other: &Colour| -> u32 {
        let squares = other.iter().zip(colour).map(|(a, b)| u32::from(a.abs_diff(b)).pow(2));
        squares.sum()
    };
    (0_u8..=255).zip(palette).min_by_key(|(_, other)| distance(other)).map_or(0, |(index, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_palette_holds_the_most_frequent_colours_and_others_go_to_the_nearest() {
        let mut counts: HashMap<Colour, u64> = (0..=255).map(|blue| ([9, 9, blue], 2)).collect();
        counts.extend([([255, 255, 255], 99), ([1, 1, 1], 1)]);
        let palette = palette(counts);
        assert_eq!((palette.len(), palette[0], palette[1]), (256, [255, 255, 255], [9, 9, 0]));
        assert_eq!(nearest_of(&palette, [250, 255, 255]), 0);
        assert_eq!(palette[usize::from(nearest_of(&palette, [1, 1, 1]))], [9, 9, 1]);
    }
}
