//! A panel of a plot: its frame, the grid with its numbers, and the names of its axes; and sheets of panels.

use crate::report::axes::LinearAxis;
use crate::report::rounding::significant;
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

/// A picture of panels one below the other, with a title above and a legend below them; all in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheet {
    /// Width of the picture.
    pub(super) width: f64,
    /// Height of a panel with its margins.
    pub(super) panel_height: f64,
    /// Margin on the right of the panels.
    pub(super) right: f64,
}

/// Margins of a panel of a sheet: on its left, above it and below it, in pixels.
const MARGINS: [f64; 3] = [76.0, 34.0, 52.0];

/// Height of a line of the legend, in pixels.
const LEGEND: f64 = 20.0;

impl Sheet {
    /// The title.
    pub(super) fn title(&self, title: &str) -> String {
        text([MARGINS[0], 20.0], 13.0, "start", "font-weight=\"bold\"", title)
    }

    /// Panel `k`, from above.
    pub(super) fn panel(&self, k: usize) -> Panel {
        let [left, above, below] = MARGINS;
        Panel {
            corner: [left, self.panel_height * k as f64 + above],
            size: [self.width - left - self.right, self.panel_height - above - below],
            numbers: 11.0,
            numbers_off: [17.0, 6.0],
            drop: 4.0,
            names: 12.0,
            names_off: [36.0, 58.0],
        }
    }

    /// Where line `k` of the legend begins, below so many panels.
    pub(super) fn legend(&self, panels: usize, k: usize) -> [f64; 2] {
        [MARGINS[0], self.panel_height * panels as f64 + LEGEND * k as f64 + 8.0]
    }

    /// Width and height of the picture.
    pub(super) fn size(&self, panels: usize, lines_of_legend: usize) -> [f64; 2] {
        [self.width, self.panel_height * panels as f64 + LEGEND * (lines_of_legend + 1) as f64]
    }
}

impl Panel {
    /// The grid with its numbers, the frame, and the names of the axes.
    pub(super) fn grid(&self, x: LinearAxis, y: LinearAxis, x_name: &str, y_name: &str) -> String {
        let mut out = String::new();
        out.extend(x.ticks().map(|tick| self.grid_x(x.share(tick), &significant(tick, 6))));
        out.extend(y.ticks().map(|tick| self.grid_y(y.share(tick), &significant(tick, 6))));
        out + &self.frame() + &self.axis_names(x_name, y_name)
    }

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
