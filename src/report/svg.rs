//! The few SVG elements that pictures are made of, as strings; coordinates are pixels, to a hundredth.

use crate::parameters::plain;

/// A coordinate: at most two decimals, none that are zero.
pub(super) fn px(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Points as an attribute: `x,y x,y ...`.
pub(super) fn points(list: impl Iterator<Item = [f64; 2]>) -> String {
    list.map(|[x, y]| format!("{},{}", px(x), px(y))).collect::<Vec<_>>().join(" ")
}

/// A disc; what it looks like, `style`, are attributes.
pub(super) fn circle([x, y]: [f64; 2], radius: f64, style: &str) -> String {
    format!("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {style}/>\n", px(x), px(y), px(radius))
}

/// Text on a base line that begins at a place, or is centred there or ends there, as `anchor` says.
pub(super) fn text([x, y]: [f64; 2], size: f64, anchor: &str, style: &str, text: &str) -> String {
    let (x, y, size, text) = (px(x), px(y), px(size), escape(text));
    format!("<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\" {style}>{text}</text>\n")
}

/// A filled shape with straight sides; what it looks like, `style`, are attributes.
pub(super) fn polygon(corners: impl Iterator<Item = [f64; 2]>, style: &str) -> String {
    format!("<polygon points=\"{}\" {style}/>\n", points(corners))
}

/// A line through many points, of class `class`.
pub(super) fn curve(class: &str, through: impl Iterator<Item = [f64; 2]>, style: &str) -> String {
    format!("<polyline class=\"{class}\" points=\"{}\" fill=\"none\" {style}/>\n", points(through))
}

/// An arrow; its head is `head` long, or less on a short arrow.
pub(super) fn arrow(from: [f64; 2], to: [f64; 2], width: f64, head: f64, colour: &str) -> String {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = (dx * dx + dy * dy).sqrt();
    if !(length > 0.0) {
        return String::new();
    }
    let (ux, uy) = (dx / length, dy / length);
    let head = head.min(0.6 * length);
    let (neck, wing) = ([to[0] - head * ux, to[1] - head * uy], 0.42 * head);
    let [x1, y1, x2, y2, width] = [from[0], from[1], neck[0], neck[1], width].map(px);
    let shaft = format!(
        "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" stroke=\"{colour}\" stroke-width=\"{width}\" \
         stroke-linecap=\"round\"/>\n"
    );
    let corners = [to, [neck[0] - wing * uy, neck[1] + wing * ux], [neck[0] + wing * uy, neck[1] - wing * ux]];
    shaft + &polygon(corners.into_iter(), &format!("fill=\"{colour}\""))
}

/// A straight line.
pub(super) fn line(from: [f64; 2], to: [f64; 2], colour: &str, width: f64) -> String {
    let [x1, y1, x2, y2, width] = [from[0], from[1], to[0], to[1], width].map(px);
    format!("<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" stroke=\"{colour}\" stroke-width=\"{width}\"/>\n")
}

/// A whole document of this size, in pixels, on white.
pub(super) fn plot(size: [f64; 2], content: &str) -> String {
    let [width, height] = size.map(px);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"DejaVu Sans, sans-serif\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{content}</svg>\n"
    )
}

/// Text with the characters escaped that mean something in XML, or that XML forbids.
pub(super) fn escape(text: &str) -> String {
    plain(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_short_and_text_is_escaped() {
        assert_eq!([px(1.0), px(-0.001), px(2.345_6), px(120.0)], ["1", "0", "2.35", "120"]);
        assert_eq!(escape("a<b & \"c\"\u{1b}"), "a&lt;b &amp; &quot;c&quot;\\u{1b}");
        assert_eq!(arrow([1.0, 1.0], [1.0, 1.0], 1.0, 1.0, "red"), "");
    }
}
