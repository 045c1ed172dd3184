//! A panel of a plot: its frame, the grid with its numbers, and the names of its axes.

use crate::report::svg::{line, px, text};

const GRID: &str = "#e4e4e4";

/// The frame of a panel and the sizes of its letters, all in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Panel {
    /// The upper left corner of the frame.
    pub(super) corner: [f64; 2],
    /// Width and height of the frame.
    pub(super) size: [f64; 2],
    /// Size of the numbers.
    pub(super) numbers: f64,
    /// From the frame down to the base line of the numbers, and to the right end of those beside it.
    pub(super) numbers_off: [f64; 2],
    /// From a line of the grid down to the base line of its number beside the frame.
    pub(super) drop: f64,
    /// Size of the names of the axes.
    pub(super) names: f64,
    /// From the frame down to the base line of the name of the x axis, and to that of the y axis beside it.
    pub(super) names_off: [f64; 2],
}

impl Panel {
    /// Where a point lies whose shares of both axes are given.
    pub(super) fn place(&self, x: f64, y: f64) -> [f64; 2] {
        let ([left, top], [width, height]) = (self.corner, self.size);
        [left + width * x, top + height * (1.0 - y)]
    }

    /// A vertical line of the grid and its number below.
    pub(super) fn grid_x(&self, share: f64, number: &str) -> String {
        let ([at, _], [_, top], [_, height]) = (self.place(share, 0.0), self.corner, self.size);
        let place = [at, top + height + self.numbers_off[0]];
        line([at, top], [at, top + height], GRID, 1.0) + &text(place, self.numbers, "middle", "", number)
    }

    /// A horizontal line of the grid and its number beside.
    pub(super) fn grid_y(&self, share: f64, number: &str) -> String {
        let ([_, at], [left, _], [width, _]) = (self.place(0.0, share), self.corner, self.size);
        let place = [left - self.numbers_off[1], at + self.drop];
        line([left, at], [left + width, at], GRID, 1.0) + &text(place, self.numbers, "end", "", number)
    }

    /// The frame itself.
    pub(super) fn frame(&self) -> String {
        let ([x, y], [width, height]) = (self.corner.map(px), self.size.map(px));
        format!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#555\"/>\n")
    }

    /// The names of both axes.
    pub(super) fn axis_names(&self, x: &str, y: &str) -> String {
        let ([left, top], [width, height], [below, beside]) = (self.corner, self.size, self.names_off);
        let (at, middle) = (left - beside, top + 0.5 * height);
        let turned = format!("transform=\"rotate(-90 {} {})\"", px(at), px(middle));
        text([left + 0.5 * width, top + height + below], self.names, "middle", "", x)
            + &text([at, middle], self.names, "middle", &turned, y)
    }
}
