//! Polygons, counter-clockwise. Everything is computed about the first vertex: far from the origin all digits would be lost otherwise.

/// The vertices, seen from the first.
fn from_first(vertices: &[[f64; 2]]) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
    let first = vertices.first().copied().unwrap_or_default();
    let seen = move |it: &[f64; 2]| [it[0] - first[0], it[1] - first[1]];
    let next = vertices.iter().cycle().skip(1);
    let pairs = vertices.iter().zip(next);
    pairs.map(move |(a, b)| (seen(a), seen(b)))
}

pub(crate) fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// \[m²\]
#[must_use]
pub fn area(vertices: &[[f64; 2]]) -> f64 {
    from_first(vertices).map(|(a, b)| cross(a, b)).sum::<f64>() / 2.0
}

/// The centre of the area; where there is none, the mean of the vertices.
#[must_use]
pub fn centroid(vertices: &[[f64; 2]]) -> Option<[f64; 2]> {
    let first = vertices.first()?;
    let mut sums = [0.0; 2];
    let mut twice = 0.0;
    for (a, b) in from_first(vertices) {
        let part = cross(a, b);
        twice += part;
        for axis in 0..2 {
            sums[axis] += (a[axis] + b[axis]) * part;
        }
    }
    let off = if twice > 0.0 {
        sums.map(|it| it / (3.0 * twice))
    } else {
        mean(from_first(vertices).map(|it| it.0))
    };
    Some([first[0] + off[0], first[1] + off[1]])
}

fn mean(points: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    let (mut count, mut sum) = (0.0, [0.0; 2]);
    for point in points {
        count += 1.0;
        sum = [sum[0] + point[0], sum[1] + point[1]];
    }
    sum.map(|it| it / count)
}

/// Where two lines `direction · p = value` meet; they are not parallel.
pub(crate) fn meet(a: ([f64; 2], f64), b: ([f64; 2], f64)) -> [f64; 2] {
    let by = cross(a.0, b.0);
    [
        (a.1 * b.0[1] - b.1 * a.0[1]) / by,
        (a.0[0] * b.1 - b.0[0] * a.1) / by,
    ]
}

/// The vertices of the polygon that is supported so in equally spaced directions, from x on.
#[must_use]
pub fn of_supports(supports: &[f64]) -> Vec<[f64; 2]> {
    let count = supports.len();
    let line = |k: usize| {
        let psi = crate::measurement::spaced(k, count);
        (crate::measurement::unit(psi), supports[k])
    };
    (0..count)
        .map(|k| meet(line(k), line((k + 1) % count)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_from_the_origin_digits_stay() {
        let at = 1e7;
        let square = [
            [at, at],
            [at + 1.0, at],
            [at + 1.0, at + 1.0],
            [at, at + 1.0],
        ];
        assert_eq!(area(&square), 1.0);
        assert_eq!(centroid(&square), Some([at + 0.5, at + 0.5]));
        assert_eq!(centroid(&[]), None);
        assert_eq!(centroid(&[[1.0, 2.0], [3.0, 2.0]]), Some([2.0, 2.0]));
    }

    #[test]
    fn supports_of_a_square_are_a_square() {
        let corners = of_supports(&[1.0; 4]);
        assert!((area(&corners) - 4.0).abs() < 1e-15);
    }
}
