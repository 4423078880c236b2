//! Limits of χ² tests on reprojection errors: 95 % quantiles, one degree of freedom for each measured quantity (Hartley and Zisserman,
//! Multiple View Geometry, table 4.2).

/// Limit for the distance from an epipolar line: one degree of freedom.
pub(crate) const CHI2_LINE: f64 = 3.84;
/// Limit for the position of a feature without depth: two degrees of freedom.
pub(crate) const CHI2_PIXEL: f64 = 5.991;
/// Limit for the position and disparity of a feature with depth: three degrees of freedom.
pub(crate) const CHI2_PIXEL_DEPTH: f64 = 7.815;
