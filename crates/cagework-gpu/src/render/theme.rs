//! Colours of themes, in sRGB.

use cagework_core::color::{byte_from_linear, linear_from_byte};

use super::layout::{RING_STATE, Style};
use super::scene::Theme;

/// States of handles, edges and faces: indices into [`Style::colors`].
pub(super) mod state {
    /// State of elements that are neither selected nor hovered.
    pub(in crate::render) const NORMAL_STATE: u32 = 0;
    /// State of hovered elements.
    pub(in crate::render) const HOVERED_STATE: u32 = 1;
    /// State of selected elements.
    pub(in crate::render) const SELECTED_STATE: u32 = 2;
    /// State of elements that are selected and hovered.
    pub(in crate::render) const BOTH_STATE: u32 = 3;
    /// State of vertices without a mirror image, in symmetric editing.
    pub(in crate::render) const UNMATCHED_STATE: u32 = 4;
}

/// Colours of a theme.
#[derive(Clone, Copy, Debug)]
pub(super) struct Palette {
    pub(super) background_top: Color,
    pub(super) background_bottom: Color,
    pub(super) floor: Color,
    pub(super) cage: Color,
    pub(super) handle: Color,
    pub(super) handle_rim: Color,
    pub(super) hovered: Color,
    pub(super) selected: Color,
    pub(super) both: Color,
    pub(super) unmatched: Color,
    /// Colour of lines on the cage's smooth surface.
    pub(super) curves: Color,
    /// Colour of controls inside the cage.
    pub(super) inner: Color,
    pub(super) wire: Color,
    pub(super) mesh_edges: Color,
    pub(super) warning: Color,
    pub(super) boundary: Color,
    pub(super) interior: Color,
    pub(super) exterior: Color,
    pub(super) cell_lines: Color,
}

/// sRGB as `0xRRGGBB`, and alpha.
pub(super) type Color = (u32, f32);

/// Colours of the gizmo's handles: axes x, y, z, view handle, view ring. The ring is thin and must contrast with dark
/// and light backgrounds.
pub(super) const AXES: [Color; 5] =
    [(0xe5484d, 1.0), (0x46a758, 1.0), (0x3e82f1, 1.0), (0xd5dae3, 1.0), (0x8a94a6, 1.0)];

/// Colour of the gizmo's handle that is hovered or dragged.
pub(super) const ACTIVE_COLOR: Color = (0xffc53d, 1.0);

const DARK_PALETTE: Palette = Palette {
    background_top: (0x3c424c, 1.0),
    background_bottom: (0x1b1d21, 1.0),
    floor: (0x9aa4b4, 0.24),
    cage: (0x86b4ff, 0.95),
    handle: (0xf3f6fc, 1.0),
    handle_rim: (0x27406e, 1.0),
    hovered: (0x5ee0ff, 1.0),
    selected: (0xffa629, 1.0),
    both: (0xffd27a, 1.0),
    unmatched: (0xff5c9a, 1.0),
    curves: (0xf3f6fc, 0.8),
    inner: (0x7fe3c4, 1.0),
    wire: (0x7fe3c4, 0.55),
    mesh_edges: (0x0b0d10, 0.42),
    warning: (0xff4d4f, 1.0),
    boundary: (0xe0913a, 1.0),
    interior: (0x2f7f86, 1.0),
    exterior: (0x8a94a3, 0.55),
    cell_lines: (0x15181d, 0.55),
};

const LIGHT_PALETTE: Palette = Palette {
    background_top: (0xfbfcfd, 1.0),
    background_bottom: (0xd4dae1, 1.0),
    floor: (0x5e6a7a, 0.30),
    cage: (0x1f5fc4, 0.95),
    handle: (0xffffff, 1.0),
    handle_rim: (0x1f5fc4, 1.0),
    hovered: (0x0b7c8c, 1.0),
    selected: (0xcf4708, 1.0),
    both: (0xa83800, 1.0),
    unmatched: (0xc2255c, 1.0),
    curves: (0x1a2740, 0.8),
    inner: (0x00875f, 1.0),
    wire: (0x1b4b8f, 0.5),
    mesh_edges: (0x10151c, 0.38),
    warning: (0xd6293e, 1.0),
    boundary: (0xe8a14a, 1.0),
    interior: (0x6db5b9, 1.0),
    exterior: (0x5e6a7a, 0.55),
    cell_lines: (0x2b333d, 0.5),
};

impl Theme {
    pub(super) fn palette(self) -> &'static Palette {
        match self {
            Self::Dark => &DARK_PALETTE,
            Self::Light => &LIGHT_PALETTE,
        }
    }
}

/// Linear colour from sRGB (IEC 61966-2-1); alpha is unchanged.
pub(super) fn linear((rgb, alpha): Color) -> [f32; 4] {
    let channel = |shift: u32| linear_from_byte((rgb >> shift & 0xff) as u8);
    [channel(16), channel(8), channel(0), alpha]
}

/// Converts a pixel of sRGB bytes from premultiplied to straight alpha, which image files use.
pub(crate) fn divide_by_alpha([rgb @ .., alpha]: &mut [u8; 4]) {
    if (1..=254).contains(alpha) {
        for value in rgb {
            *value = byte_from_linear(linear_from_byte(*value) * 255.0 / f32::from(*alpha));
        }
    }
}

impl Palette {
    /// Colours of all states. `normal`: colour of elements that are neither selected nor hovered.
    fn states(&self, normal: Color) -> [[f32; 4]; 8] {
        let mut colors = [linear(normal); 8];
        colors[state::HOVERED_STATE as usize] = linear(self.hovered);
        colors[state::SELECTED_STATE as usize] = linear(self.selected);
        colors[state::BOTH_STATE as usize] = linear(self.both);
        colors[state::UNMATCHED_STATE as usize] = linear(self.unmatched);
        colors
    }

    /// Style of the cage's edges.
    pub(super) fn cage_lines(&self) -> Style {
        Style {
            colors: self.states(self.cage),
            widths: [[1.5, 2.5, 2.75, 3.25], [1.5; 4]],
            lift: 1e-3,
            opacity: 1.0,
            size: 1.0,
            ..Style::default()
        }
    }

    /// Style of the edges of a faint cage.
    pub(super) fn faint_lines(&self) -> Style {
        Style { opacity: 0.35, ..self.cage_lines() }
    }

    /// Style of the edges between cage faces on the smooth surface.
    pub(super) fn curves(&self, is_faint: bool) -> Style {
        let opacity = if is_faint { 0.75 } else { 1.0 };
        Style { colors: [linear(self.curves); 8], widths: [[1.25; 4]; 2], opacity, ..self.cage_lines() }
    }

    /// Style of the edges of balls, tubes and sheets around controls inside the cage.
    pub(super) fn shells(&self) -> Style {
        Style { colors: self.states(self.inner), widths: [[0.9; 4]; 2], opacity: 0.6, ..self.cage_lines() }
    }

    /// Style of the edges between controls inside the cage.
    pub(super) fn bones(&self) -> Style {
        Style { colors: self.states(self.inner), widths: [[2.0; 4]; 2], ..self.cage_lines() }
    }

    /// Style of controls inside the cage.
    pub(super) fn inner(&self) -> Style {
        // The rim is white because these controls are drawn over the model, not over the background.
        Style { colors: self.states(self.inner), rim_color: [1.0, 1.0, 1.0, 0.9], ..self.handles() }
    }

    /// Style of the cage's vertices.
    pub(super) fn handles(&self) -> Style {
        Style {
            colors: self.states(self.handle),
            widths: [[8.0, 11.0, 10.5, 12.0], [9.5, 8.0, 8.0, 8.0]],
            rim_color: linear(self.handle_rim),
            rim: 1.4,
            lift: 4e-3,
            opacity: 1.0,
            size: 1.0,
        }
    }

    /// Style of the cage's faces.
    pub(super) fn faces(&self) -> Style {
        let mut colors = self.states(self.cage);
        for (color, alpha) in colors.iter_mut().zip([0.0, 0.16, 0.30, 0.38, 0.2]) {
            color[3] = alpha;
        }
        Style { colors, opacity: 1.0, size: 1.0, ..Style::default() }
    }

    /// Style of the wireframe of the rest pose (`base`), or of the mesh's edges.
    pub(super) fn wire(&self, base: bool) -> Style {
        let color = if base { self.wire } else { self.mesh_edges };
        Style {
            colors: [linear(color); 8],
            widths: [[if base { 0.9 } else { 0.8 }; 4]; 2],
            lift: 1.5e-3,
            opacity: 1.0,
            size: 1.0,
            ..Style::default()
        }
    }

    /// Style of places with a problem.
    pub(super) fn marks(&self) -> Style {
        Style {
            colors: [linear(self.warning); 8],
            widths: [[7.0; 4], [3.0; 4]],
            rim_color: [1.0, 1.0, 1.0, 0.9],
            rim: 1.2,
            lift: 6e-3,
            opacity: 1.0,
            size: 1.0,
        }
    }

    /// Style of grabbed points.
    pub(super) fn held(&self) -> Style {
        Style { colors: [linear(self.selected); 8], widths: [[11.0; 4], [2.0; 4]], ..self.marks() }
    }

    /// Style of the edges of a cage that is being made or is not valid.
    pub(super) fn draft(&self) -> Style {
        Style { colors: [linear(self.cage); 8], widths: [[1.5; 4]; 2], ..self.cage_lines() }
    }

    /// Style of joints: dots and rings.
    pub(super) fn joints(&self) -> Style {
        let color = linear((self.wire.0, 1.0));
        let mut colors = [color; 8];
        colors[RING_STATE as usize][3] = 0.0;
        Style { colors, widths: [[8.0, 9.0, 8.0, 8.0], [2.0; 4]], rim_color: color, rim: 2.0, ..self.marks() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance (IEC 61966-2-1).
    fn luminance(color: Color) -> f32 {
        let [r, g, b, _] = linear(color);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    /// Contrast ratio of WCAG 2.
    fn contrast(a: Color, b: Color) -> f32 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn division_by_alpha_inverts_premultiplication() {
        for alpha in [40_u8, 128, 254, 255] {
            let shown = 200_u8;
            let product = byte_from_linear(linear_from_byte(shown) * f32::from(alpha) / 255.0);
            let mut pixel = [product, 0, product, alpha];
            divide_by_alpha(&mut pixel);
            // `product` was rounded to a byte, so the quotient differs from `shown` by up to 2.
            assert!(pixel[0].abs_diff(shown) <= 2 && pixel[0] == pixel[2], "{pixel:?}");
            assert_eq!([pixel[1], pixel[3]], [0, alpha]);
        }
    }

    /// WCAG 2.2, 1.4.11: graphics need a contrast of 3 : 1 to adjacent colours.
    #[test]
    fn cage_and_marks_contrast_with_the_background() {
        for palette in [&DARK_PALETTE, &LIGHT_PALETTE] {
            for color in [
                palette.cage,
                palette.selected,
                palette.warning,
                palette.unmatched,
                palette.hovered,
                palette.inner,
            ] {
                for background in [palette.background_top, palette.background_bottom] {
                    let contrast = contrast(color, background);
                    assert!(contrast >= 3.0, "{:06x} on {:06x}: {contrast}", color.0, background.0);
                }
            }
            let rim = contrast(palette.handle, palette.handle_rim);
            assert!(rim >= 3.0, "a handle's rim: {rim}");
        }
    }

    #[test]
    fn white_is_one_and_black_is_zero() {
        assert_eq!(linear((0xff_ffff, 0.5)), [1.0, 1.0, 1.0, 0.5]);
        assert_eq!(linear((0, 1.0)), [0.0, 0.0, 0.0, 1.0]);
    }
}
