#include "boundary/curves/mirror_faces.h"

#include <algorithm>
#include <cmath>

#include "boundary/meshes/trees/placement.h"
#include "scene/lights/light_params.h"
#include "scene/mesh_instances.h"

namespace edgegrad {
namespace {

// The irradiance at a point from the sized lights, roughly, and the same from any direction. A light that a
// face does not see counts a little, since its other points may.
class Irradiance {
 public:
    explicit Irradiance(const LightView& lights) {
        for (int32_t k = 0; k < lights.all_sized(); ++k) {
            const int32_t row = lights.sized[k];
            if (!(lights.visible_to[row] & kBentRays)) continue;
            const float* p = lights.params + kLightParams * static_cast<ptrdiff_t>(row);
            const double radiance = std::abs(p[0] + p[1] + p[2]) / 3.0;
            rows_.push_back({lights.kind[lights.light_of_row[row]], vector_at(p + kLightPosition),
                             vector_at(p + kLightDirection), radiance * static_cast<double>(p[kLightArea]),
                             radiance, static_cast<double>(p[kLightRadius])});
        }
    }
    double at(Vector x, Vector n, double extent) const {
        constexpr double kLeast = 0.05;
        double sum = 0.0;
        for (const Row& l : rows_) {
            if (l.kind == kConeLight) {
                sum += l.power * std::max(kLeast, std::abs(dot(n, l.direction)));
                continue;
            }
            const Vector way = l.position - x;
            const double r2 = std::max(dot(way, way), 1e-30), r = std::sqrt(r2);
            double facing = 1.0, power = l.power;
            if (l.kind == kRectangleLight || l.kind == kEllipseLight)
                facing = std::max(kLeast, -dot(way, l.direction) / r);
            else
                power = 3.14159265 * l.radius * l.radius * l.radiance;
            sum += power * facing * std::max(kLeast, std::abs(dot(n, way)) / r) /
                   (r2 + extent + 0.1 * l.radius * l.radius);
        }
        return sum;
    }

 private:
    struct Row {
        int32_t kind;
        Vector position, direction;
        double power, radiance, radius;
    };
    std::vector<Row> rows_;
};

}  // namespace

Candidates mirror_faces(const SceneView& scene, const SceneTables& tables, const std::vector<uint8_t>& bends,
                        bool lit) {
    const Irradiance light(scene.lights);
    const auto instances = mesh_instances(tables);
    Candidates out;
    for (int32_t mesh = 0; mesh < tables.first_field(); ++mesh) {
        const auto m = static_cast<size_t>(mesh);
        if (!(tables.mesh_mask[m] & kScatteredRays)) continue;
        for (const int32_t instance : instances[m]) {
            const Placement place = Placement::of(scene, instance);
            for (int32_t face = tables.mesh_first_face[m]; face < tables.mesh_first_face[m + 1]; ++face) {
                if (!bends[static_cast<size_t>(scene.face_material[face])]) continue;
                Vector p[3];
                for (int k = 0; k < 3; ++k)
                    p[k] = place(vertex(scene, static_cast<int64_t>(scene.faces[3 * int64_t{face} + k])));
                const Vector normal = cross(p[1] - p[0], p[2] - p[0]);
                const double size = length(normal);
                if (!(size > 0.0)) continue;
                const double mass = lit ? size * light.at((p[0] + p[1] + p[2]) * (1.0 / 3.0),
                                                          normal * (1.0 / size), 0.25 * size)
                                        : 0.5 * size;
                if (!(mass > 0.0) || !std::isfinite(mass)) continue;
                out.add(face, 0.0f, 1.0f, mass);
                out.instance.push_back(instance);
            }
        }
    }
    return out;
}

}  // namespace edgegrad
