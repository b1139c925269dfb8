!> Potential on the band: `sum_f k_f (phi_c - phi_nb) = r_c` by conjugate gradients.
!!
!! Red cells, no two of which are neighbours, are eliminated: the unknowns are the black ones, which
!! takes half the iterations of the whole system at the same cost each. All parts of the band go
!! side by side, each with its own coefficients, until each has converged; sums are order-free and
!! need one message for all parts.
!!
!! `krylov_m` has conjugate gradients, too. They share no line with these: there a step is the same
!! number for all cells of a block, here a number for each part; there preconditioner and operator
!! are passed in and act on whole blocks, here the elimination of the red cells takes the place of
!! the preconditioner, and the product with the matrix also makes the terms of the energy. What is
!! left in common are the two quotients of the method.
module flux_potential_m
  use kinds_m, only: wp, i8
  use growing_m, only: ensure_room
  use flux_band_m, only: flux_band_t
  use solve_control_m, only: solve_control_t
  use exact_sum_m, only: exact_add, exact_totals, bin_size, no_terms
  use parallel_m, only: halo_exchange, global_max
  implicit none
  private
  public :: flux_potential_t, solve_potential

  integer, parameter :: worth_threads = 8000   !! cells of a part that several threads share

  !> Work of the solver: lists over the cells of the band, and numbers of its parts.
  type :: flux_potential_t
    real(wp), allocatable :: phi(:)               !! potential [V]
    real(wp), allocatable :: s(:), terms(:)       !! A p, and the terms of a sum
    real(wp), allocatable :: energy(:)            !! (parts) p.Ap or r.r/diagonal
    real(wp), allocatable :: before(:)            !! (parts) r.r/diagonal of the direction
    integer(i8), allocatable :: bins(:, :)        !! of the sums
  end type flux_potential_t

contains

  !> Solve for the parts that are active; the potential stands in `p`, halo filled, zero elsewhere.
  subroutine solve_potential(control, band, self, iterations)
    type(solve_control_t), intent(in) :: control   !! tolerance of the balance of a cell [V]
    type(flux_band_t), intent(inout) :: band   !! `largest` returns the rest of the active parts [V]
    type(flux_potential_t), intent(inout) :: self
    integer, intent(out) :: iterations
    logical :: wanted(band%parts)
    integer :: c

    iterations = 0
    band%p = 0.0_wp
    wanted = band%active(1:band%parts)
    call make_room(band, self)
    call reduce_to_black(band, self)
    do
      call drop_converged(control%tolerance, band)
      if (.not. any(band%active(1:band%parts)) .or. iterations == control%max_iterations) exit
      call next_direction(iterations == 0, band, self)
      call halo_exchange(band%p, 1)
      call red_values(.false., band)
      call halo_exchange(band%p, 1)
      call advance(band, self)
      iterations = iterations + 1
    end do
    band%active(1:band%parts) = wanted
    do c = 1, band%parts
      if (.not. wanted(c)) cycle
      associate (a => band%first(2*c), b => band%first(2*c + 1) - 1)
        call put(band%at(a:b), self%phi(a:b), band%p)
      end associate
    end do
    call halo_exchange(band%p, 1)
    call red_values(.true., band)
    call halo_exchange(band%p, 1)
  end subroutine solve_potential

  !> Room for the lists and parts of the band.
  subroutine make_room(band, self)
    type(flux_band_t), intent(in) :: band
    type(flux_potential_t), intent(inout) :: self

    call ensure_room(band%n, self%phi)
    call ensure_room(band%n, self%s)
    call ensure_room(band%n, self%terms)
    call ensure_room(band%parts, self%before)
    call ensure_room(band%parts, self%energy)
    if (.not. allocated(self%bins)) allocate (self%bins(bin_size, size(self%energy)))
    if (size(self%bins, 2) >= size(self%energy)) return
    deallocate (self%bins)
    allocate (self%bins(bin_size, size(self%energy)))
  end subroutine make_room

  !> Steps in memory to the next cell in x, y and z, and to the next direction of a face array.
  pure function strides(band) result(step)
    type(flux_band_t), intent(in) :: band
    integer :: step(4)
    integer :: extent(3)

    extent = shape(band%p)
    step = [1, extent(1), extent(1)*extent(2), product(extent)]
  end function strides

  !> Right-hand side of the black cells: their own and what the red ones pass on. The potential is
  !! zero.
  subroutine reduce_to_black(band, self)
    type(flux_band_t), intent(inout) :: band
    type(flux_potential_t), intent(inout) :: self
    integer :: c, l

    call red_values(.true., band)   ! with a potential of zero: r over the diagonal
    call halo_exchange(band%p, 1)
    do c = 1, band%parts
      if (.not. band%active(c)) cycle
      associate (a => band%first(2*c), b => band%first(2*c + 1) - 1)
        call apply(band%at(a:b), band%diagonal(a:b), strides(band), band%k, band%p, self%s(a:b), &
                   self%terms(a:b))
        band%largest(c) = 0.0_wp
        do l = a, b
          self%phi(l) = 0.0_wp
          band%r(l) = band%r(l) - self%s(l)
          band%largest(c) = max(band%largest(c), abs(band%r(l)))
        end do
      end associate
    end do
  end subroutine reduce_to_black

  !> A part has converged when no cell misses more than the tolerance.
  subroutine drop_converged(tolerance, band)
    real(wp), intent(in) :: tolerance
    type(flux_band_t), intent(inout) :: band

    call global_max(band%largest(1:band%parts))
    band%active(1:band%parts) = band%active(1:band%parts) .and. &
                                band%largest(1:band%parts) > tolerance
  end subroutine drop_converged

  !> Next search direction of the black cells, p := r/diagonal + step*p.
  subroutine next_direction(start, band, self)
    logical, intent(in) :: start
    type(flux_band_t), intent(inout) :: band
    type(flux_potential_t), intent(inout) :: self
    integer :: c, l
    real(wp) :: step

    do c = 1, band%parts
      self%bins(:, c) = no_terms
      if (.not. band%active(c)) cycle
      do l = band%first(2*c), band%first(2*c + 1) - 1
        self%terms(l) = band%r(l)*(band%r(l)/band%diagonal(l))
      end do
      call exact_add(self%terms(band%first(2*c):band%first(2*c + 1) - 1), self%bins(:, c))
    end do
    call exact_totals(self%bins(:, 1:band%parts), self%energy(1:band%parts))
    do c = 1, band%parts
      if (.not. band%active(c)) cycle
      step = 0.0_wp
      if (.not. start) step = self%energy(c)/self%before(c)
      self%before(c) = self%energy(c)
      associate (a => band%first(2*c), b => band%first(2*c + 1) - 1)
        call turn(band%at(a:b), band%r(a:b), band%diagonal(a:b), step, band%p)
      end associate
    end do
  end subroutine next_direction

  !> Values of the red cells that balance them, with their own r or without.
  subroutine red_values(with_r, band)
    logical, intent(in) :: with_r
    type(flux_band_t), intent(inout) :: band
    integer :: c

    do c = 1, band%parts
      if (.not. band%active(c)) cycle
      associate (a => band%first(2*c - 1), b => band%first(2*c) - 1)
        call balance(band%at(a:b), band%r(a:b), merge(1.0_wp, 0.0_wp, with_r), &
                     band%diagonal(a:b), strides(band), band%k, band%p)
      end associate
    end do
  end subroutine red_values

  !> One step along the search direction; `largest` is what the cells miss afterwards.
  subroutine advance(band, self)
    type(flux_band_t), intent(inout) :: band
    type(flux_potential_t), intent(inout) :: self
    integer :: c

    do c = 1, band%parts
      self%bins(:, c) = no_terms
      if (.not. band%active(c)) cycle
      associate (a => band%first(2*c), b => band%first(2*c + 1) - 1)
        call apply(band%at(a:b), band%diagonal(a:b), strides(band), band%k, band%p, self%s(a:b), &
                   self%terms(a:b))
        call exact_add(self%terms(a:b), self%bins(:, c))
      end associate
    end do
    call exact_totals(self%bins(:, 1:band%parts), self%energy(1:band%parts))
    do c = 1, band%parts
      if (.not. band%active(c)) cycle
      band%active(c) = self%energy(c) > 0.0_wp   ! else nothing is left but round-off
      if (.not. band%active(c)) cycle
      associate (a => band%first(2*c), b => band%first(2*c + 1) - 1)
        call move(band%at(a:b), self%before(c)/self%energy(c), band%p, self%s(a:b), &
                  self%phi(a:b), band%r(a:b), band%largest(c))
      end associate
    end do
  end subroutine advance

  !> p := r/diagonal + step*p at the cells of the list.
  pure subroutine turn(at, r, diagonal, step, p)
    integer, intent(in), contiguous :: at(:)
    real(wp), intent(in), contiguous :: r(:), diagonal(:)
    real(wp), intent(in) :: step
    real(wp), intent(inout) :: p(*)
    integer :: l

    do l = 1, size(at)
      p(at(l)) = r(l)/diagonal(l) + step*p(at(l))
    end do
  end subroutine turn

  !> p := (share*r + sum k p_nb)/diagonal at the cells of the list.
  subroutine balance(at, r, share, diagonal, step, k, p)
    integer, intent(in), contiguous :: at(:)
    real(wp), intent(in), contiguous :: r(:), diagonal(:)
    real(wp), intent(in) :: share
    integer, intent(in) :: step(4)   !! see `strides`
    real(wp), intent(in) :: k(step(4), 3)
    real(wp), intent(inout) :: p(step(4))
    integer :: l, c, in_y, in_z

    in_y = step(2)
    in_z = step(3)
    !$omp parallel do private(c) schedule(static) if (size(at) > worth_threads)
    do l = 1, size(at)
      c = at(l)
      p(c) = (share*r(l) + ((k(c, 1)*p(c - 1) + k(c + 1, 1)*p(c + 1)) &
                            + (k(c, 2)*p(c - in_y) + k(c + in_y, 2)*p(c + in_y)) &
                            + (k(c, 3)*p(c - in_z) + k(c + in_z, 3)*p(c + in_z))))/diagonal(l)
    end do
  end subroutine balance

  !> s := A p and the terms p*s of its energy at the cells of the list.
  subroutine apply(at, diagonal, step, k, p, s, terms)
    integer, intent(in), contiguous :: at(:)
    real(wp), intent(in), contiguous :: diagonal(:)
    integer, intent(in) :: step(4)   !! see `strides`
    real(wp), intent(in) :: k(step(4), 3), p(step(4))
    real(wp), intent(inout), contiguous :: s(:), terms(:)
    integer :: l, c, in_y, in_z

    in_y = step(2)
    in_z = step(3)
    !$omp parallel do private(c) schedule(static) if (size(at) > worth_threads)
    do l = 1, size(at)
      c = at(l)
      s(l) = diagonal(l)*p(c) - ((k(c, 1)*p(c - 1) + k(c + 1, 1)*p(c + 1)) &
                                 + (k(c, 2)*p(c - in_y) + k(c + in_y, 2)*p(c + in_y)) &
                                 + (k(c, 3)*p(c - in_z) + k(c + in_z, 3)*p(c + in_z)))
      terms(l) = p(c)*s(l)
    end do
  end subroutine apply

  !> phi := phi + step*p, r := r - step*s, and the largest |r|.
  pure subroutine move(at, step, p, s, phi, r, largest)
    integer, intent(in), contiguous :: at(:)
    real(wp), intent(in) :: step, p(*)
    real(wp), intent(in), contiguous :: s(:)
    real(wp), intent(inout), contiguous :: phi(:), r(:)
    real(wp), intent(out) :: largest
    integer :: l

    largest = 0.0_wp
    do l = 1, size(at)
      phi(l) = phi(l) + step*p(at(l))
      r(l) = r(l) - step*s(l)
      largest = max(largest, abs(r(l)))
    end do
  end subroutine move

  !> Put a list on the grid.
  pure subroutine put(at, list, p)
    integer, intent(in), contiguous :: at(:)
    real(wp), intent(in), contiguous :: list(:)
    real(wp), intent(inout) :: p(*)
    integer :: l

    do l = 1, size(at)
      p(at(l)) = list(l)
    end do
  end subroutine put

end module flux_potential_m
