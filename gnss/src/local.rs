//! The common frame: a plane that touches the earth at the datum.
#![allow(unsafe_code)]

use std::f64::consts::FRAC_PI_2;

use sguaba::math::RigidBodyTransform;
use sguaba::systems::{Ecef, EnuComponents, Wgs84};
use sguaba::{Coordinate, system};
use uom::si::angle::{degree, radian};
use uom::si::f64::{Angle, Length};
use uom::si::length::meter;

system!(struct Plane using ENU);

/// The point of the earth where the frame has its origin, and how it is turned.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Datum {
    /// North of the equator (degrees).
    pub latitude_deg: f64,
    /// East of Greenwich (degrees).
    pub longitude_deg: f64,
    /// Above the ellipsoid (m).
    pub height_m: f64,
    /// From east to the x axis, to the left (rad).
    pub turned_rad: f64,
}

/// Places of the earth in the common frame.
#[derive(Clone, Debug)]
pub struct LocalFrame {
    datum: Datum,
    plane: RigidBodyTransform<Ecef, Plane>,
    sin_cos: (f64, f64),
}

impl LocalFrame {
    /// The frame at `datum`; none if that is no point of the earth.
    #[must_use]
    pub fn new(datum: Datum) -> Option<Self> {
        let origin = wgs84(datum.latitude_deg, datum.longitude_deg, datum.height_m)?;
        // SAFETY: `Plane` has its origin at the datum: it is made here, for this frame alone, and leaves it as plain numbers.
        let plane = unsafe { RigidBodyTransform::ecef_to_enu_at(&origin) };
        Some(Self {
            datum,
            plane,
            sin_cos: datum.turned_rad.sin_cos(),
        })
    }

    /// Where it is.
    #[must_use]
    pub fn datum(&self) -> Datum {
        self.datum
    }

    /// x, y and the height above the plane (m) of a place; without a height, at that of the datum. None if it is no point of the
    /// earth.
    #[must_use]
    pub fn to_local(&self, place: [f64; 2], height_m: Option<f64>) -> Option<[f64; 3]> {
        let place = wgs84(place[0], place[1], height_m.unwrap_or(self.datum.height_m))?;
        let point = self.plane.transform(Coordinate::from_wgs84(&place));
        let [east, north, up] = point.to_cartesian().map(|it| it.get::<meter>());
        let [x, y] = self.turn([east, north]);
        Some([x, y, up])
    }

    /// Latitude, longitude (degrees) and height (m) of a point of the frame.
    #[must_use]
    pub fn to_earth(&self, point: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = self.sin_cos;
        let [x, y, up] = point;
        let metres = Length::new::<meter>;
        let point = Coordinate::<Plane>::build(EnuComponents {
            east: metres(x * cos - y * sin),
            north: metres(x * sin + y * cos),
            up: metres(up),
        });
        let place = self.plane.inverse_transform(point).to_wgs84();
        [
            place.latitude().get::<degree>(),
            place.longitude().get::<degree>(),
            place.altitude().get::<meter>(),
        ]
    }

    /// A vector east and north, along the axes of the frame.
    #[must_use]
    pub fn turn(&self, [east, north]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.sin_cos;
        [east * cos + north * sin, north * cos - east * sin]
    }

    /// An angle from true north to the right (degrees) at a place, from the x axis to the left (rad). Away from the datum north is not
    /// quite the plane's north: the meridians meet at the pole.
    #[must_use]
    pub fn heading(&self, degrees: f64, place: [f64; 2]) -> f64 {
        let east_deg = (place[1] - self.datum.longitude_deg + 180.0).rem_euclid(360.0) - 180.0;
        let convergence = east_deg.to_radians() * self.datum.latitude_deg.to_radians().sin();
        FRAC_PI_2 - degrees.to_radians() + convergence - self.datum.turned_rad
    }
}

fn wgs84(latitude_deg: f64, longitude_deg: f64, height_m: f64) -> Option<Wgs84> {
    let is_finite = longitude_deg.is_finite() && height_m.is_finite();
    let builder = Wgs84::builder().latitude(Angle::new::<degree>(latitude_deg))?;
    let place = builder
        .longitude(Angle::new::<radian>(longitude_deg.to_radians()))
        .altitude(Length::new::<meter>(height_m))
        .build();
    (is_finite && latitude_deg.is_finite()).then_some(place)
}

#[cfg(test)]
mod tests {
    use map_3d::{Ellipsoid, geodetic2enu};
    use proptest::prelude::*;

    use super::*;

    fn frame(latitude_deg: f64, longitude_deg: f64, height_m: f64, turned_rad: f64) -> LocalFrame {
        LocalFrame::new(Datum {
            latitude_deg,
            longitude_deg,
            height_m,
            turned_rad,
        })
        .unwrap()
    }

    fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    }

    #[test]
    fn a_turned_frame_turns_points_and_headings_alike() {
        let straight = frame(48.0, 11.0, 500.0, 0.0);
        let turned = frame(48.0, 11.0, 500.0, 0.5);
        let north = [48.001, 11.0];
        let [x, y, _] = straight.to_local(north, None).unwrap();
        assert!(x.abs() < 1e-6 && (y - 111.2).abs() < 0.1);
        let [x, y, _] = turned.to_local(north, None).unwrap();
        let here = [48.0, 11.0];
        assert!((y.atan2(x) - turned.heading(0.0, here)).abs() < 1e-9);
        assert!((straight.heading(90.0, here)).abs() < 1e-12);
    }

    #[test]
    fn north_is_the_meridian_of_the_place() {
        for (latitude, longitude) in [(48.0, 179.95), (-33.0, 18.0), (0.0, 0.0)] {
            let frame = frame(latitude, longitude, 0.0, 0.3);
            let place = |north: f64| {
                let east = (longitude + 0.1 + 180.0).rem_euclid(360.0) - 180.0;
                frame.to_local([latitude + north, east], None).unwrap()
            };
            let ([x, y, _], [x2, y2, _]) = (place(0.0), place(1e-5));
            let meridian = (y2 - y).atan2(x2 - x);
            let east = (longitude + 0.1 + 180.0).rem_euclid(360.0) - 180.0;
            let off = meridian - frame.heading(0.0, [latitude, east]);
            assert!(off.abs() < 1e-5, "{off}");
        }
    }

    #[test]
    fn what_is_no_point_of_the_earth_is_none() {
        let frame = frame(48.0, 11.0, 500.0, 0.0);
        for place in [[91.0, 0.0], [f64::NAN, 0.0], [0.0, f64::INFINITY]] {
            assert_eq!(frame.to_local(place, None), None);
        }
        assert_eq!(frame.to_local([0.0, 0.0], Some(f64::NAN)), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4096))]

        /// There and back, within 10 km: no more than a micrometre.
        #[test]
        fn the_way_there_and_back_ends_where_it_began(
            latitude in -89.9_f64..89.9,
            longitude in -180.0_f64..180.0,
            height in -100.0_f64..5000.0,
            turned in -4.0_f64..4.0,
            point in [-1e4_f64..1e4, -1e4_f64..1e4, -300.0_f64..300.0],
        ) {
            let frame = frame(latitude, longitude, height, turned);
            let [latitude, longitude, height] = frame.to_earth(point);
            let back = frame.to_local([latitude, longitude], Some(height)).unwrap();
            prop_assert!(distance(point, back) <= 1e-6, "{point:?} {back:?}");
        }

        /// Another library, written by others, says the same.
        #[test]
        fn another_library_agrees(
            latitude in -89.0_f64..89.0,
            longitude in -179.0_f64..179.0,
            height in -100.0_f64..5000.0,
            point in [-1e4_f64..1e4, -1e4_f64..1e4, -300.0_f64..300.0],
        ) {
            let frame = frame(latitude, longitude, height, 0.0);
            let [here, there, up] = frame.to_earth(point);
            let radians = f64::to_radians;
            let (east, north, up) = geodetic2enu(
                radians(here), radians(there), up,
                radians(latitude), radians(longitude), height, Ellipsoid::WGS84,
            );
            prop_assert!(distance(point, [east, north, up]) <= 1e-6, "{point:?} {east} {north} {up}");
        }
    }
}
