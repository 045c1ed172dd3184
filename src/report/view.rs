//! What part of the world a picture shows, and where in it a point of the world is drawn.
//!
//! The picture is the world turned by a quarter, so that droplets fall: gravity, which is +x, points down, and +y
//! points right.

use crate::results::outline::Outline;

/// Room above the droplet, below it, and on either side, in sigma.
const MARGINS: [f64; 3] = [1.25, 0.85, 1.05];

/// Room round a whole path, in sigma.
const PATH_MARGIN: f64 = 1.0;

/// Least width and height of what is shown, in sigma.
const LEAST: [f64; 2] = [3.4, 3.2];

/// Least width, greatest width and greatest height of a picture, in pixels.
const PIXELS: [f64; 3] = [600.0, 1000.0, 1500.0];

/// Largest scale, in pixels per sigma.
const LARGEST_SCALE: f64 = 200.0;

/// A window on the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    /// x of the upper edge.
    pub top: f64,
    /// y of the left edge.
    pub left: f64,
    /// Extent along y, in sigma.
    pub width: f64,
    /// Extent along x, in sigma.
    pub height: f64,
    /// Pixels per sigma.
    pub scale: f64,
}

/// The box around a droplet; a soft particle is a disc of diameter sigma.
fn bounds(outline: &Outline) -> [f64; 4] {
    let [x0, x1, y0, y1] = outline.bounds();
    let r = if outline.x.len() > 1 { 0.0 } else { 0.5 };
    [x0 - r, x1 + r, y0 - r, y1 + r]
}

impl View {
    /// A window on the box `[x_min, x_max, y_min, y_max]`, widened about its middle where it is too small.
    fn on([x0, x1, y0, y1]: [f64; 4]) -> Self {
        let (mut width, height) = ((y1 - y0).max(LEAST[0]), (x1 - x0).max(LEAST[1]));
        let scale = LARGEST_SCALE.min(PIXELS[1] / width).min(PIXELS[2] / height);
        width = width.max(PIXELS[0] / scale);
        Self { top: 0.5 * (x0 + x1 - height), left: 0.5 * (y0 + y1 - width), width, height, scale }
    }

    /// A window around the droplet, with more room where it came from.
    pub(crate) fn around(outline: &Outline) -> Self {
        let [x0, x1, y0, y1] = bounds(outline);
        let [above, below, beside] = MARGINS;
        Self::on([x0 - above, x1 + below, y0 - beside, y1 + beside])
    }

    /// A window on the whole path `[t, x, y]` and all droplets.
    pub(crate) fn whole(path: &[[f64; 3]], outlines: &[Outline]) -> Self {
        let points = path.iter().map(|&[_, x, y]| [x, x, y, y]);
        let all = points
            .chain(outlines.iter().map(bounds))
            .reduce(|[a, b, c, d], [x0, x1, y0, y1]| [a.min(x0), b.max(x1), c.min(y0), d.max(y1)]);
        let [x0, x1, y0, y1] = all.unwrap_or([0.0; 4]);
        Self::on([x0 - PATH_MARGIN, x1 + PATH_MARGIN, y0 - PATH_MARGIN, y1 + PATH_MARGIN])
    }

    /// Windows of one size, one for each outline, with the droplet in the middle.
    pub(crate) fn following(outlines: &[Outline]) -> Vec<Self> {
        let views: Vec<Self> = outlines.iter().map(Self::around).collect();
        let width = views.iter().fold(0.0_f64, |width, view| width.max(view.width));
        let height = views.iter().fold(0.0_f64, |height, view| height.max(view.height));
        let size = Self::on([0.0, height, 0.0, width]);
        let centred = |view: &Self| Self {
            top: view.top + 0.5 * (view.height - size.height),
            left: view.left + 0.5 * (view.width - size.width),
            ..size
        };
        views.iter().map(centred).collect()
    }

    /// Where the point (x, y) of the world is drawn.
    pub(crate) fn place(&self, x: f64, y: f64) -> [f64; 2] {
        [(y - self.left) * self.scale, (x - self.top) * self.scale]
    }

    /// Size in pixels.
    pub(crate) fn size(&self) -> [f64; 2] {
        [(self.width * self.scale).round(), (self.height * self.scale).round()]
    }

    /// The box `[x_min, x_max, y_min, y_max]` that it shows.
    pub(crate) fn bounds(&self) -> [f64; 4] {
        [self.top, self.top + self.height, self.left, self.left + self.width]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_that_follow_a_droplet_have_one_size_and_hold_it() {
        let outline = |x: f64, long: f64| Outline { x: vec![x, x + long], y: vec![2.0, 3.0], ..Default::default() };
        let outlines = [outline(0.0, 1.0), outline(7.0, 4.0), outline(20.0, 1.0)];
        let views = View::following(&outlines);
        for (view, outline) in views.iter().zip(&outlines) {
            assert_eq!(view.size(), views[0].size());
            let ([x0, x1, y0, y1], [a, b, c, d]) = (view.bounds(), outline.bounds());
            assert!(x0 < a && b < x1 && y0 < c && d < y1);
        }
    }

    #[test]
    fn gravity_points_down_and_y_to_the_right() {
        let view = View::around(&Outline { x: vec![5.0], y: vec![5.0], ..Default::default() });
        let ([u0, v0], [u1, v1]) = (view.place(5.0, 5.0), view.place(5.5, 6.0));
        assert!((u1 - u0 - view.scale).abs() < 1e-9 && (v1 - v0 - 0.5 * view.scale).abs() < 1e-9);
    }
}
