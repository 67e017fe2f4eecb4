// The lobes of a BSDF (shading/bsdf/closures.h).
#pragma once

namespace edgegrad {

enum Lobe { kDiffuseLobe, kTranslucentLobe, kMirrorLobe, kCoatLobe, kInterfaceLobe, kSheenLobe, kLobes };

}  // namespace edgegrad
