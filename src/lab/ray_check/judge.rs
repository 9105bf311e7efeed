//! A result along a ray, judged by the exact hit.

use bvhscope_engine::geometry::{Ray, Triangle};

use super::exact::{ExactHit, Line, Meeting};

/// How a result relates to the nearest hit in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Agreement {
    /// The same triangle, or nothing.
    Same,
    /// Another triangle at the same distance: at a shared edge, or in the same place.
    OtherTriangle,
    /// Hit or missed by rounding: at an edge with nothing behind it, or at an end of the ray.
    Rounding,
    /// Passed between triangles that share an edge.
    Leak,
    /// Another distance.
    OtherDistance,
    /// A miss where there is a hit.
    FalseMiss,
    /// A hit where there is nothing.
    FalseHit,
}

impl Agreement {
    /// All, the worst last.
    pub const ALL: [Self; 7] = [
        Self::Same,
        Self::OtherTriangle,
        Self::Rounding,
        Self::Leak,
        Self::OtherDistance,
        Self::FalseMiss,
        Self::FalseHit,
    ];

    /// The name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::OtherTriangle => "other_triangle",
            Self::Rounding => "rounding",
            Self::Leak => "leak",
            Self::OtherDistance => "other_distance",
            Self::FalseMiss => "false_miss",
            Self::FalseHit => "false_hit",
        }
    }

    /// The head of its column, in two lines.
    pub(super) const fn head(self) -> [&'static str; 2] {
        match self {
            Self::Same => ["same", "hit"],
            Self::OtherTriangle => ["same t, other", "triangle"],
            Self::Rounding => ["within", "rounding"],
            Self::Leak => ["through a", "shared edge"],
            Self::OtherDistance => ["another", "t"],
            Self::FalseMiss => ["miss for", "hit"],
            Self::FalseHit => ["hit for", "miss"],
        }
    }

    /// True if rounding does not explain it.
    pub fn is_fault(self) -> bool {
        self > Self::Rounding
    }
}

/// Hits of one ray, judged.
pub(super) struct Judge<'a> {
    triangles: &'a [Triangle],
    line: Line,
    exact: Option<ExactHit>,
}

impl<'a> Judge<'a> {
    pub(super) fn new(triangles: &'a [Triangle], ray: &Ray, exact: Option<ExactHit>) -> Self {
        Self { triangles, line: Line::new(ray), exact }
    }

    fn meeting(&self, triangle: u32) -> Meeting {
        self.line.meeting(&self.triangles[triangle as usize])
    }

    /// A nearest hit: its triangle, and its distance where it is known.
    pub(super) fn nearest(&self, found: Option<(u32, Option<f64>)>) -> Agreement {
        let Some((triangle, t)) = found else {
            return self.exact.map_or(Agreement::Same, |exact| self.missed(exact, Agreement::FalseMiss));
        };
        let own = self.meeting(triangle);
        let t = t.unwrap_or(f64::midpoint(own.near, own.far));
        let is_possible = own.is_possible() && own.allows(t);
        let Some(exact) = self.exact else {
            return if is_possible { Agreement::Rounding } else { Agreement::FalseHit };
        };
        let is_same_distance = own.allows(exact.t) || self.meeting(exact.triangle).allows(t);
        match (is_possible, is_same_distance) {
            (false, _) => Agreement::OtherDistance,
            (true, _) if triangle == exact.triangle => Agreement::Same,
            (true, true) => Agreement::OtherTriangle,
            (true, false) if t < exact.t => Agreement::Rounding,
            (true, false) => self.missed(exact, Agreement::OtherDistance),
        }
    }

    /// A distance without a triangle, which is infinite for a miss.
    pub(super) fn distance(&self, t: f64) -> Agreement {
        match self.exact {
            _ if t.is_infinite() => self.nearest(None),
            None => self.nothing(),
            Some(exact) if self.meeting(exact.triangle).allows(t) => Agreement::Same,
            Some(exact) if t > exact.t => self.missed(exact, Agreement::OtherDistance),
            Some(_) => Agreement::OtherDistance,
        }
    }

    /// Whether anything was found.
    pub(super) fn any(&self, is_hit: bool) -> Agreement {
        match (is_hit, self.exact) {
            (true, Some(_)) | (false, None) => Agreement::Same,
            (true, None) => self.nothing(),
            (false, Some(exact)) => self.missed(exact, Agreement::FalseMiss),
        }
    }

    /// A hit where there is none: by rounding where any triangle allows that.
    fn nothing(&self) -> Agreement {
        let [t_min, t_max] = self.line.limits;
        let is_possible = self.triangles.iter().any(|triangle| {
            let meeting = self.line.meeting(triangle);
            meeting.is_possible() && meeting.near <= t_max && meeting.far >= t_min
        });
        if is_possible { Agreement::Rounding } else { Agreement::FalseHit }
    }

    /// The exact hit was not found, which is `fault` if rounding does not explain it.
    fn missed(&self, exact: ExactHit, fault: Agreement) -> Agreement {
        let meeting = self.meeting(exact.triangle);
        let [t_min, t_max] = self.line.limits;
        if meeting.allows(t_min) || meeting.allows(t_max) {
            Agreement::Rounding
        } else if meeting.is_sure() {
            fault
        } else if self.continues(exact.triangle, meeting.edge) {
            Agreement::Leak
        } else {
            Agreement::Rounding
        }
    }

    /// Whether a triangle on the other side of an edge, as the ray sees it, has the same edge.
    fn continues(&self, triangle: u32, edge: usize) -> bool {
        let own = &self.triangles[triangle as usize];
        let corners = [own.a, own.b, own.c];
        let [third, p, q] = [0, 1, 2].map(|place| corners[(edge + place) % 3]);
        let across = (q.as_dvec3() - p.as_dvec3()).cross(self.line.direction);
        let side = |corner: glam::Vec3| across.dot(corner.as_dvec3() - p.as_dvec3());
        self.triangles.iter().any(|other| {
            let corners = [other.a, other.b, other.c];
            corners.contains(&p)
                && corners.contains(&q)
                && corners.iter().any(|&corner| side(corner) * side(third) < 0.0)
        })
    }
}
