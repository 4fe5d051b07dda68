template <class R> struct Rule<SAINT_VENANT_KIRCHHOFF, R> {
  typedef Lanes<R> S;
  // tau = b (mu (b - 1) + lambda/2 tr(b - 1)) = (1 + E) A; c its wave modulus.
  CUDA_CALLABLE static inline void stress(const Material<R> &t, const R *E, R j1, R *tau, R &c) {
    R A[6], half = 0.5f * t.lambda * (E[0] + E[3] + E[5]);
    for (int k = 0; k < 6; k++) A[k] = t.mu * E[k];
    for (int k = 0; k < 6; k += k == 3 ? 2 : 3) A[k] += half;
    Sym<R>::times(E, A, tau);
    for (int k = 0; k < 6; k++) tau[k] += A[k];
    R s = 1.0f + Sym<R>::bound(E), swollen = S::high(E[0] + E[3] + E[5], S::all(0.0f));
    c = s * (2.0f * t.mu * (2.0f * s - 1.0f) + t.lambda * (s + swollen));
  }
  // mu |G|^2 + lambda/2 (tr G)^2 with 2 G = FtF - 1
  CUDA_CALLABLE static inline double energy(double mu, double lambda, const double *H) {
    double l[3], sum = 0, trace = 0;
    Strain<double>::squares(H, l);
    for (int i = 0; i < 3; i++) {
      sum += 0.25 * l[i] * l[i];
      trace += 0.5 * l[i];
    }
    return mu * sum + 0.5 * lambda * trace * trace;
  }
};
