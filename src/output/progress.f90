!> The table that a person follows on standard output while a run goes on, and its closing words.
module progress_m
  use, intrinsic :: iso_fortran_env, only: output_unit, error_unit
  use kinds_m, only: wp, i8
  use errors_m, only: to_text, brief
  use value_text_m, only: fixed_text
  use parallel_m, only: is_root, spins_for_long
  use timers_m, only: wall_clock
  use rigid_body_m, only: blocks_t, let_go
  use case_types_m, only: not_resolved
  use clock_m, only: clock_t
  use diagnostics_m, only: quantity_t, value_of
  implicit none
  private
  public :: progress_t

  integer, parameter :: lines_per_header = 25
  real(wp), parameter, public :: line_interval = 1.0_wp   !! of wall time [s]

  type :: progress_t
    logical :: shown = .false.            !! on this process, and not forbidden by --quiet
    logical :: fluid = .true.
    integer :: lines = 0
    integer :: last_step = -1             !! of the last line
    integer :: warnings = 0
    integer(i8) :: clips = 0              !! limits of added inertia that cut it, in all steps
    integer :: first_step = 0             !! where this part of the run began
    real(wp) :: first_time = 0.0_wp       !! likewise [s]
    real(wp) :: began = 0.0_wp            !! wall clock at the start [s]
    real(wp) :: last_line = -huge(1.0_wp) !! wall clock at the last line [s]
  contains
    procedure :: start, store_clips, line => write_line, summary
  end type progress_t

contains

  !> Begin to count time.
  subroutine start(self, quiet, fluid, light, clock)
    class(progress_t), intent(out) :: self
    logical, intent(in) :: quiet
    logical, intent(in) :: fluid   !! there is one
    logical, intent(in) :: light   !! there is a water without flow
    type(clock_t), intent(in) :: clock

    self%shown = is_root() .and. .not. quiet
    self%fluid = fluid
    self%first_step = clock%step
    self%first_time = clock%t
    self%began = wall_clock()
    if (light) call say(not_resolved, self)
    if (spins_for_long()) call say('threads spin while they wait: where other programs want the ' &
      //'cores, export GOMP_SPINCOUNT=1000 first, or take --threads 1', self)
  end subroutine start

  !> Count what the limits of added inertia cut in a step, and warn of the first that do.
  subroutine store_clips(self, time, clips)
    class(progress_t), intent(inout) :: self
    real(wp), intent(in) :: time    !! [s]
    integer, intent(in) :: clips    !! of the step

    if (clips > 0 .and. self%clips == 0) then
      self%warnings = self%warnings + 1
      if (is_root()) then
        write (error_unit, '(a)') 'mics: warning: the inertia of the fluid that moves with light ' &
          //'blocks was cut at its limit, '//to_text(clips)//' time(s) in the step to t = ' &
          //brief(time, 5)//' s; /series/inertia_clips of run.h5 counts it in each step'
        flush (error_unit)
      end if
    end if
    self%clips = self%clips + clips
  end subroutine store_clips

  !> Write one line, if this step has none yet; the header first where it is time for it.
  subroutine write_line(self, clock, row, blocks)
    class(progress_t), intent(inout) :: self
    type(clock_t), intent(in) :: clock
    type(quantity_t), intent(in) :: row(:)
    type(blocks_t), intent(in) :: blocks
    character(*), parameter :: block_columns = '   released  moving  asleep overlap [mm]'
    character(160) :: line
    character(11) :: left
    character(13) :: overlap
    real(wp) :: seconds
    integer :: released, s

    if (.not. self%shown .or. clock%step == self%last_step) return
    self%last_step = clock%step
    if (modulo(self%lines, lines_per_header) == 0) then
      if (self%fluid) then
        call say('    step      t [s]    dt [s]  Courant  div. [1/s]  passes  iterations' &
                 //block_columns//'      drift  time left', self)
      else
        call say('    step      t [s]    dt [s]  substeps  Courant'//block_columns//'  time left', &
                 self)
      end if
    end if
    self%lines = self%lines + 1
    self%last_line = wall_clock()
    released = count(blocks%status == let_go)
    if (self%fluid) then
      write (line, '(i8, f11.5, es10.2, f9.3, es12.2, i8, i12)') clock%step, clock%t, of('dt'), &
        of('cfl'), of('divergence_max'), nint(of('pressure_passes')), nint(of('solver_iterations'))
    else
      write (line, '(i8, f11.5, es10.2, i10, f9.3)') clock%step, clock%t, of('dt'), &
        nint(of('substeps')), of('contact_courant_max')
    end if
    overlap = '            -'   ! of a line between rows
    if (of('max_overlap') >= 0.0_wp) write (overlap, '(f13.4)') 1.0e3_wp*of('max_overlap')
    write (line(len_trim(line) + 1:), '(a11, i8, i8, a)') to_text(released)//'/' &
      //to_text(blocks%n), count(blocks%speed > clock%run%rest_speed), count(blocks%asleep), overlap
    if (self%fluid) write (line(len_trim(line) + 1:), '(es11.1)') of('liquid_volume_drift')
    ! wall time to the end at the mean speed so far, as h:mm:ss
    seconds = 3.6e6_wp
    if (clock%t > self%first_time) seconds = (wall_clock() - self%began) &
      *(clock%run%t_end - clock%t)/(clock%t - self%first_time)
    left = '          -'
    s = nint(min(seconds, 3.6e6_wp))
    if (seconds < 3.6e6_wp) write (left, '(i5, 2(":", i2.2))') s/3600, modulo(s/60, 60), &
      modulo(s, 60)
    call say(trim(line)//left, self)
  contains
    pure real(wp) function of(name)
      character(*), intent(in) :: name

      of = value_of(row, name)
    end function of
  end subroutine write_line

  !> One line to whoever reads; nothing more once the reader has gone.
  subroutine say(line, self)
    character(*), intent(in) :: line
    class(progress_t), intent(inout) :: self
    integer :: info

    if (.not. self%shown) return
    write (output_unit, '(a)', iostat=info) line
    if (info == 0) flush (output_unit, iostat=info)
    self%shown = info == 0
  end subroutine say

  !> Say how the run went.
  subroutine summary(self, clock, cells, exit_code, folder)
    class(progress_t), intent(inout) :: self
    type(clock_t), intent(in) :: clock
    integer(i8), intent(in) :: cells   !! of the whole domain
    integer, intent(in) :: exit_code
    character(*), intent(in) :: folder
    character(:), allocatable :: how, line
    real(wp) :: seconds
    integer :: steps

    if (.not. self%shown) return
    seconds = wall_clock() - self%began
    steps = clock%step - self%first_step
    how = 'stopped with code '//to_text(exit_code)
    if (exit_code == 0) how = 'finished'
    if (exit_code == 0 .and. clock%settled()) how = 'settled'
    line = how//' at t = '//fixed_text(clock%t, 5)//' s: '//to_text(steps)//' steps in ' &
      //fixed_text(seconds, 1)//' s'
    if (self%fluid .and. steps > 0) line = line//', ' &
      //fixed_text(1.0e6_wp*seconds/(real(steps, wp)*real(cells, wp)), 3)//' us per cell and step'
    if (self%clips > 0) line = line//', impacts of light blocks less exact (inertia of water cut ' &
      //to_text(int(min(self%clips, int(huge(1), i8))))//' times)'
    if (self%warnings > 0) line = line//', '//to_text(self%warnings)//' warnings'
    call say(line, self)
    call say('results in '//folder, self)
  end subroutine summary

end module progress_m
