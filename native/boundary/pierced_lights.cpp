#include "boundary/pierced_lights.h"

#include <cmath>

#include "boundary/copy_crossings.h"
#include "boundary/face_cut.h"
#include "scene/light_params.h"
#include "scene/mesh_instances.h"

namespace edgegrad {
namespace {

// A rectangle or ellipse of the light table.
struct FlatLight {
    Vector center, x, y;  // half axes
    bool ellipse;
    Box box;

    FlatLight(const float* row, bool is_ellipse) : ellipse(is_ellipse) {
        const auto vector = [&](int at) { return Vector{row[at], row[at + 1], row[at + 2]}; };
        center = vector(kLightPosition);
        x = vector(kLightAxisX) * static_cast<double>(row[kLightExtentX]);
        y = vector(kLightAxisY) * static_cast<double>(row[kLightExtentY]);
        for (double s : {-1.0, 1.0})
            for (double t : {-1.0, 1.0}) {
                const Vector p = center + x * s + y * t;
                const float corner[3] = {static_cast<float>(p.x), static_cast<float>(p.y),
                                         static_cast<float>(p.z)};
                box.add(corner);
            }
    }

    // The line along which a triangle cuts the light; false if there is none, or an edge of it lies in the
    // light's plane.
    bool cut_by(const Triangle3& t, Vector (&ends)[2]) const {
        const Vector normal = cross(x, y), along = cross(t.normal, normal);
        const double scale2 = dot(t.normal, t.normal) * dot(normal, normal);
        if (!(dot(along, along) > kParallel * scale2)) return false;
        if (!cut(t, Triangle3(center, center + x, center + y), ends)) return false;
        // The part of it where the light is: of a + b k, k from 0 to 1, in the frame of the half axes.
        const auto place = [&](const Vector& p, const Vector& axis) {
            return dot(p - center, axis) / dot(axis, axis);
        };
        const double a[2] = {place(ends[0], x), place(ends[0], y)};
        const double b[2] = {place(ends[1], x) - a[0], place(ends[1], y) - a[1]};
        double low = 0.0, high = 1.0;
        if (ellipse) {
            const double bb = b[0] * b[0] + b[1] * b[1], ab = a[0] * b[0] + a[1] * b[1];
            const double root = ab * ab - bb * (a[0] * a[0] + a[1] * a[1] - 1.0);
            if (!(root > 0.0)) return false;
            low = std::max(low, (-ab - std::sqrt(root)) / bb);
            high = std::min(high, (-ab + std::sqrt(root)) / bb);
        } else {
            for (int c = 0; c < 2; ++c) {
                if (b[c] == 0.0) {
                    if (std::abs(a[c]) >= 1.0) return false;
                    continue;
                }
                const double one = (-1.0 - a[c]) / b[c], other = (1.0 - a[c]) / b[c];
                low = std::max(low, std::min(one, other));
                high = std::min(high, std::max(one, other));
            }
        }
        if (!(high > low)) return false;
        const Vector first = ends[0], way = ends[1] - ends[0];
        ends[0] = first + way * low;
        ends[1] = first + way * high;
        return length(ends[1] - ends[0]) > kOnPlane * t.size;
    }
};

}  // namespace

Crossings find_pierced_lights(const SceneTables& tables, const Asked& asked, const Crossings& crossings,
                              const int32_t* emissive, int threads) {
    Crossings out;
    for (int64_t k = 0; k < crossings.size() && emissive; ++k) {
        const uint32_t* faces = &crossings.faces[static_cast<size_t>(2 * k)];
        if (emissive[faces[0]] < 0 && emissive[faces[1]] < 0) continue;
        out.add(crossings, k);
    }
    const auto instances = mesh_instances(tables);
    for (size_t row = 0; row < tables.lights.kind.size(); ++row) {
        const int32_t kind = tables.lights.kind[row];
        if (kind != kRectangleLight && kind != kEllipseLight) continue;
        const FlatLight light(&tables.lights.params[kLightParams * row], kind == kEllipseLight);
        for (size_t mesh = 0; mesh < instances.size(); ++mesh) {
            const bool turns = asked.instances && is_placed(instances[mesh]);
            if (!(asked.lights || asked.moving[mesh] || turns)) continue;
            const Box box = mesh_box(tables, mesh);
            for (int32_t instance : instances[mesh]) {
                const MeshCopy copy(tables, static_cast<int32_t>(mesh), instance, box);
                if (!copy.box.meets(light.box)) continue;
                for (int32_t face :
                     faces_in(tables, static_cast<int32_t>(mesh), copy.local(light.box), threads)) {
                    Vector ends[2];
                    if (light.cut_by(Triangle3(tables, face, copy.place), ends))
                        out.add(ends, {static_cast<uint32_t>(face), instance},
                                {kLightOfTable | static_cast<uint32_t>(row)});
                }
            }
        }
    }
    return out;
}

}  // namespace edgegrad
