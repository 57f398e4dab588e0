#include "core/propagation/block_vector.h"

#include <array>
#include <cmath>

namespace polyest::internal {
namespace {

using Values = Eigen::ArrayXXd;
using Lanes = Eigen::Array<double, kLanes, 1>;

struct Content {
  Values values;
  ErrorScale* scale;
};

Content* ContentOf(N_Vector vector) { return static_cast<Content*>(vector->content); }
Values& Of(N_Vector vector) { return ContentOf(vector)->values; }

N_Vector_ID GetVectorId(N_Vector) { return SUNDIALS_NVEC_CUSTOM; }
sunindextype GetLength(N_Vector x) { return Of(x).size(); }
double* GetArrayPointer(N_Vector x) { return Of(x).data(); }

N_Vector Clone(N_Vector x) {
  N_Vector copy = N_VNewEmpty(x->sunctx);
  N_VCopyOps(x, copy);
  copy->content = new Content{Values::Zero(Of(x).rows(), Of(x).cols()), ContentOf(x)->scale};
  return copy;
}

void Destroy(N_Vector x) {
  if (x == nullptr) return;
  delete ContentOf(x);
  x->content = nullptr;
  N_VFreeEmpty(x);
}

void Space(N_Vector x, sunindextype* reals, sunindextype* integers) {
  *reals = Of(x).size();
  *integers = 2;
}

void LinearSum(double a, N_Vector x, double b, N_Vector y, N_Vector z) {
  Of(z) = a * Of(x) + b * Of(y);
}
void Constant(double c, N_Vector z) { Of(z).setConstant(c); }
void Product(N_Vector x, N_Vector y, N_Vector z) { Of(z) = Of(x) * Of(y); }
void Quotient(N_Vector x, N_Vector y, N_Vector z) { Of(z) = Of(x) / Of(y); }
void Absolute(N_Vector x, N_Vector z) { Of(z) = Of(x).abs(); }
void Inverse(N_Vector x, N_Vector z) { Of(z) = Of(x).inverse(); }
void AddConstant(N_Vector x, double b, N_Vector z) { Of(z) = Of(x) + b; }
double DotProduct(N_Vector x, N_Vector y) { return (Of(x) * Of(y)).sum(); }
double MaxNorm(N_Vector x) { return Of(x).abs().maxCoeff(); }
double Minimum(N_Vector x) { return Of(x).minCoeff(); }
double L1Norm(N_Vector x) { return Of(x).abs().sum(); }
double WeightedL2Norm(N_Vector x, N_Vector w) { return std::sqrt((Of(x) * Of(w)).square().sum()); }
double ErrorNorm(N_Vector x, N_Vector w) { return ContentOf(x)->scale->Norm(Of(x), Of(w)); }

void Scale(double c, N_Vector x, N_Vector z) {
  if (c != 1) {
    Of(z) = c * Of(x);
  } else if (x != z) {
    Of(z) = Of(x);
  }
}

// Computes z = Σ_k c_k x_k with all terms at once for each eight numbers, so z may be one of the
// x_k.
template <int kTerms>
void Combine(const double* c, const double* const* x, double* z, Eigen::Index size) {
  for (Eigen::Index i = 0; i < size; i += kLanes) {
    Lanes sum = c[0] * Lanes::Map(x[0] + i);
    for (int k = 1; k < kTerms; ++k) sum += c[k] * Lanes::Map(x[k] + i);
    Lanes::Map(z + i) = sum;
  }
}

constexpr int kMaxTerms = 8;  // of one pass

int CombineTerms(int terms, const double* c, const double* const* x, double* z, Eigen::Index size) {
  switch (terms) {
    case 0:
      std::fill_n(z, size, 0.0);
      return 0;
    case 1:
      Combine<1>(c, x, z, size);
      return 0;
    case 2:
      Combine<2>(c, x, z, size);
      return 0;
    case 3:
      Combine<3>(c, x, z, size);
      return 0;
    case 4:
      Combine<4>(c, x, z, size);
      return 0;
    case 5:
      Combine<5>(c, x, z, size);
      return 0;
    case 6:
      Combine<6>(c, x, z, size);
      return 0;
    case 7:
      Combine<7>(c, x, z, size);
      return 0;
    default:
      Combine<8>(c, x, z, size);
      return 0;
  }
}

int LinearCombination(int vectors, double* c, N_Vector* x, N_Vector z) {
  if (vectors > kMaxTerms) {
    // z may be X[0] only, so the first eight terms can be summed into it.
    LinearCombination(kMaxTerms, c, x, z);
    for (int k = kMaxTerms; k < vectors; ++k) Of(z) += c[k] * Of(x[k]);
    return 0;
  }
  std::array<double, kMaxTerms> factors;
  std::array<const double*, kMaxTerms> terms;
  int used = 0;
  for (int k = 0; k < vectors; ++k) {
    if (c[k] == 0) continue;  // skips the zeros of a Butcher table
    factors[used] = c[k];
    terms[used++] = Of(x[k]).data();
  }
  return CombineTerms(used, factors.data(), terms.data(), Of(z).data(), Of(z).size());
}

int ScaleAddMulti(int vectors, double* a, N_Vector x, N_Vector* y, N_Vector* z) {
  for (int k = 0; k < vectors; ++k) LinearSum(a[k], x, 1, y[k], z[k]);
  return 0;
}

int ScaleVectorArray(int vectors, double* c, N_Vector* x, N_Vector* z) {
  for (int k = 0; k < vectors; ++k) Scale(c[k], x[k], z[k]);
  return 0;
}

void SetOperations(N_Vector_Ops ops) {
  ops->nvgetvectorid = GetVectorId;
  ops->nvclone = Clone;
  ops->nvdestroy = Destroy;
  ops->nvspace = Space;
  ops->nvgetarraypointer = GetArrayPointer;
  ops->nvgetlength = GetLength;
  ops->nvlinearsum = LinearSum;
  ops->nvconst = Constant;
  ops->nvprod = Product;
  ops->nvdiv = Quotient;
  ops->nvscale = Scale;
  ops->nvabs = Absolute;
  ops->nvinv = Inverse;
  ops->nvaddconst = AddConstant;
  ops->nvdotprod = DotProduct;
  ops->nvmaxnorm = MaxNorm;
  ops->nvwrmsnorm = ErrorNorm;
  ops->nvmin = Minimum;
  ops->nvwl2norm = WeightedL2Norm;
  ops->nvl1norm = L1Norm;
  ops->nvlinearcombination = LinearCombination;
  ops->nvscaleaddmulti = ScaleAddMulti;
  ops->nvscalevectorarray = ScaleVectorArray;
}

}  // namespace

N_Vector NewBlockVector(Eigen::Index points, Eigen::Index states, ErrorScale* scale,
                        SUNContext context) {
  N_Vector vector = N_VNewEmpty(context);
  SetOperations(vector->ops);
  vector->content = new Content{Values::Zero(points, states), scale};
  return vector;
}

Eigen::ArrayXXd& BlockValues(N_Vector vector) { return Of(vector); }

}  // namespace polyest::internal
